"""Count the imports of the package: arrows between rooms, the longest chain of modules, imports that climb back.

python tools/rooms.py
"""

from functools import cache

import grimp

PACKAGES = ("vessel_hsmc_ros", "vessel_sim_node")


def room(module: str) -> str:
    """The room of a module: its package below the top, or the module there."""
    return ".".join(module.split(".")[:2]) if module.startswith(PACKAGES[0]) else PACKAGES[1]


def main() -> None:
    """Print the counts."""
    graph = grimp.build_graph(*PACKAGES, exclude_type_checking_imports=True)
    imports = {module: graph.find_modules_directly_imported_by(module) for module in graph.modules}
    arrows = {(room(one), room(other)) for one, others in imports.items() for other in others if room(one) != room(other)}

    @cache
    def chain(module: str) -> tuple[str, ...]:
        return (module, *max(map(chain, sorted(imports[module])), key=len, default=()))

    longest = max(map(chain, sorted(graph.modules)), key=len)
    print(f"{len({room(module) for module in graph.modules})} rooms, {len(arrows)} arrows between them")
    print(f"{len(graph.modules)} modules, the longest chain has {len(longest)}: {' > '.join(longest)}")


if __name__ == "__main__":
    main()
