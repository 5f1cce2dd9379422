"""Small changes of Python source, as a slip of the keyboard or of the mind makes them."""

import ast
from collections.abc import Collection, Iterator
from typing import NamedTuple

COMPARISONS: dict[type[ast.cmpop], type[ast.cmpop]] = {
    **{ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq},
    **{ast.Is: ast.IsNot, ast.IsNot: ast.Is},
}
SUMS: dict[type[ast.operator], type[ast.operator]] = {ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult}


class Change(NamedTuple):
    """A piece of a source, from one place to another, and what takes its place; lines from 1, columns in bytes."""

    line: int
    column: int
    end_line: int
    end_column: int
    text: str
    kind: str

    def applied(self, source: str) -> str:
        """The source with the change."""
        lines = [line.encode() for line in source.splitlines(keepends=True)]
        before = b"".join(lines[: self.line - 1]) + lines[self.line - 1][: self.column]
        after = lines[self.end_line - 1][self.end_column :] + b"".join(lines[self.end_line :])
        return (before + self.text.encode() + after).decode()


def changes(source: str, lines: Collection[int]) -> list[Change]:
    """All changes of a source whose first line is one of some lines; texts and annotations stay as they are."""
    found = []
    for node in _code(ast.parse(source)):
        if node.lineno in lines:
            place = node.lineno, node.col_offset, node.end_lineno or node.lineno, node.end_col_offset or 0
            for kind, text in _variants(node):
                found.append(Change(*place, text, kind))
    return found


def _code(node: ast.AST) -> Iterator[ast.expr | ast.stmt]:
    """The expressions and statements below a node that are run; not those of annotations and formatted texts."""
    for name, value in ast.iter_fields(node):
        if name in ("annotation", "returns", "decorator_list", "bases") or isinstance(node, ast.JoinedStr):
            continue
        for child in value if isinstance(value, list) else [value]:
            if isinstance(child, ast.keyword) and child.arg == "strict":  # without an effect on lists of one length
                continue
            if isinstance(child, ast.expr | ast.stmt):
                yield child
            if isinstance(child, ast.AST):
                yield from _code(child)


def _variants(node: ast.expr | ast.stmt) -> Iterator[tuple[str, str]]:
    """The kinds and texts of what may take the place of a node."""
    if isinstance(node, ast.Compare) and len(node.ops) == 1 and type(node.ops[0]) in COMPARISONS:
        yield "comparison", _unparsed(ast.Compare(node.left, [COMPARISONS[type(node.ops[0])]()], node.comparators))
    elif isinstance(node, ast.BinOp) and type(node.op) in SUMS:
        yield "operator", _unparsed(ast.BinOp(node.left, SUMS[type(node.op)](), node.right))
    elif isinstance(node, ast.BoolOp):
        yield "condition", _unparsed(ast.BoolOp(ast.And() if isinstance(node.op, ast.Or) else ast.Or(), node.values))
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not | ast.USub):
        yield "sign", _unparsed(node.operand)
    elif isinstance(node, ast.IfExp):
        yield "branch", _unparsed(ast.IfExp(node.test, node.orelse, node.body))
    elif isinstance(node, ast.Constant) and isinstance(node.value, bool | int | float):
        value = (not node.value) if isinstance(node.value, bool) else 2 * node.value or 1
        yield "constant", repr(value)
    elif isinstance(node, ast.Call) and len(node.args) > 1 and not any(isinstance(a, ast.Starred) for a in node.args[:2]):
        swapped = [node.args[1], node.args[0], *node.args[2:]]
        yield "arguments", _unparsed(ast.Call(node.func, swapped, node.keywords))
    elif isinstance(node, ast.Expr) and isinstance(node.value, ast.Call):
        yield "dropped call", "pass"


def _unparsed(node: ast.expr) -> str:
    """The source of an expression in parentheses, which fit everywhere."""
    return f"({ast.unparse(ast.fix_missing_locations(node))})"
