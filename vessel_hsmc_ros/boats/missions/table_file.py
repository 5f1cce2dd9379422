"""Missions as tables, CSV with a row of names, in latitude and longitude or in metres."""

import csv

from vessel_hsmc_ros.boats.missions.mission import MAX_POINTS, NAMES, Mission, MissionPoint, Source, with_properties

PLACES = {
    "latitude": "latitude",
    "lat": "latitude",
    "longitude": "longitude",
    "lon": "longitude",
    "lng": "longitude",
    "long": "longitude",
    "x": "x",
    "east": "x",
    "y": "y",
    "north": "y",
}
"""Columns of places: metres to the east and north, or degrees."""

UNUSED = ("z", "altitude", "alt", "number")

SEPARATORS = ",;\t"

FORM = (
    f"a row of names: latitude and longitude in degrees, or x and y in metres, and perhaps {', '.join(NAMES)};"
    f" {', '.join(UNUSED)} are not used"
)

FARTHEST = 1e6


def read_table(text: str, source: Source) -> Mission:
    """The mission of a table. Raises ScenarioError if a column is unknown or missing, or a value is no number or out of range."""
    lines = [(number, line) for number, line in enumerate(text.splitlines(), 1) if line.strip() and not line.startswith("#")]
    if not lines:
        raise source.error("it is empty")
    (first, head), *rows = lines
    separator = max(SEPARATORS, key=head.count)
    try:
        columns = _columns([cell.strip() for cell in next(csv.reader([head], delimiter=separator))], first, source)
        cells = [(n, next(csv.reader([line], delimiter=separator, skipinitialspace=True))) for n, line in rows]
    except csv.Error as error:
        raise source.error(f"it is no table: {error}") from None
    if len(cells) > MAX_POINTS:
        raise source.error(f"it must have at most {MAX_POINTS} rows (got {len(cells)})")
    return Mission(tuple(_point(columns, row, f"line {n}", source) for n, row in cells), "latitude" in columns)


def _columns(names: list[str], line: int, source: Source) -> list[str]:
    """What each column is. Raises ScenarioError as `read_table`."""
    columns = [PLACES.get(name.lower(), name.lower()) for name in names]
    unknown = [name for name, column in zip(names, columns, strict=True) if column not in (*PLACES, *NAMES, *UNUSED)]
    places = {"latitude", "longitude"} & {*columns}, {"x", "y"} & {*columns}
    if unknown or len({*columns}) < len(columns) or sorted(map(len, places)) != [0, 2]:
        shown = ", ".join(names)
        raise source.error(f"line {line} must be {FORM} (got {shown[:200]})")
    return columns


def _point(columns: list[str], row: list[str], item: str, source: Source) -> MissionPoint:
    if len(row) != len(columns):
        raise source.error(f"{item} must have {len(columns)} values (got {len(row)})")
    values = dict(zip(columns, row, strict=True))
    if "latitude" in values:
        place = source.degrees(values["latitude"], values["longitude"], item)
    else:
        place = tuple(source.number(values[name], f"{item}: {name}", -FARTHEST, FARTHEST) for name in ("x", "y"))  # type: ignore[assignment]
    return with_properties(place, item, {name: values[name] for name in NAMES if name in values}, source)
