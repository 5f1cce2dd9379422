"""The sockets of a process as the kernel lists them in /proc, and free ports."""

import socket
import struct
from pathlib import Path

TABLES = ("tcp", "udp", "tcp6", "udp6")


def sockets_of(pid: int) -> list[str]:
    """The local addresses of a process's internet sockets."""
    own = {link.removeprefix("socket:[").removesuffix("]") for link in _links(pid) if link.startswith("socket:[")}
    found = []
    for table in TABLES:
        for line in Path(f"/proc/{pid}/net/{table}").read_text().splitlines()[1:]:
            fields = line.split()
            if fields[9] in own:
                found.append(_address(fields[1].split(":")[0]))
    return found


def free_port() -> int:
    """A port of UDP that nothing on this machine uses at present."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def _links(pid: int) -> list[str]:
    found = []
    for path in Path(f"/proc/{pid}/fd").iterdir():
        try:
            found.append(str(path.readlink()))
        except OSError:  # closed meanwhile
            continue
    return found


def _address(code: str) -> str:
    if len(code) == 8:
        return socket.inet_ntoa(struct.pack("=I", int(code, 16)))
    return socket.inet_ntop(socket.AF_INET6, struct.pack("=4I", *(int(code[i : i + 8], 16) for i in range(0, 32, 8))))
