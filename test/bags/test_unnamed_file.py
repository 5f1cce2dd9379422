"""Bytes on the disk instead of in memory."""

from pathlib import Path

from vessel_hsmc_ros.bags.crash_safe_file import PIECE, UnnamedFile


def test_an_unnamed_file_gives_back_in_pieces_what_was_appended_and_leaves_no_name(tmp_path: Path) -> None:
    file = UnnamedFile(tmp_path)
    parts = [bytes([number]) * (PIECE // 3) for number in range(7)]
    for part in parts:
        file.append(part)
    pieces = list(file.content.pieces())
    assert b"".join(pieces) == b"".join(parts)
    assert max(map(len, pieces)) == PIECE
    assert not list(tmp_path.iterdir())
    file.close()
