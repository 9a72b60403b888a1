"""List the mutants of a source file: each is the file with one small change.

Changed are comparisons, arithmetic, ``and`` and ``or``, constants, signs, ``not``, and pairs of functions such as min
and max. Left out is what no test should notice: docstrings, type annotations, decorators, ``__repr__``, f-strings and
the ``raise`` statements with their messages. Other strings are not changed either.
"""

from __future__ import annotations

import ast
import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

COMPARISONS = {"<": "<=", "<=": "<", ">": ">=", ">=": ">", "==": "!=", "!=": "==", "is": "is not", "is not": "is"}
COMPARISONS |= {"in": "not in", "not in": "in"}
ARITHMETIC = {"+": "-", "-": "+", "*": "/", "/": "*", "//": "*", "%": "*", "**": "*"}
ARITHMETIC |= {"<<": ">>", ">>": "<<", "&": "|", "|": "&", "^": "&"}
FUNCTIONS = {"min": "max", "minimum": "maximum", "argmin": "argmax", "floor": "ceil", "any": "all"}
FUNCTIONS |= {new: old for old, new in FUNCTIONS.items()}
LARGE = 10  # a whole number from here on is doubled, a smaller one is changed by one

SYMBOLS = {
    ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!=", ast.Is: "is",
    ast.IsNot: "is not", ast.In: "in", ast.NotIn: "not in", ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/",
    ast.FloorDiv: "//", ast.Mod: "%", ast.Pow: "**", ast.LShift: "<<", ast.RShift: ">>", ast.BitAnd: "&",
    ast.BitOr: "|", ast.BitXor: "^",
}  # fmt: skip
SEQUENCES = (ast.JoinedStr, ast.List, ast.Tuple, ast.ListComp)
TYPES = {"int", "float", "str", "bytes", "bool", "list", "dict", "tuple", "set"}


@dataclass(frozen=True, kw_only=True)
class Mutant:
    """One change of one file: the bytes from start to end are replaced by the text.

    `change` is the line before and after, with a number behind it if the same change is possible more than once in
    the function. File, function and change name a mutant also after lines have moved.
    """

    file: str
    line: int
    function: str
    change: str
    start: int
    end: int
    text: str

    @property
    def name(self) -> tuple[str, str, str]:
        """What names the mutant in tables."""
        return self.file, self.function, self.change

    def apply(self, source: bytes) -> bytes:
        """Return the changed source."""
        return source[: self.start] + self.text.encode() + source[self.end :]


def mutants_of(file: str, source: bytes) -> list[Mutant]:
    """Return all mutants of a source file, in the order of its lines."""
    finder = _Finder(source)
    finder.visit(ast.parse(source))
    seen: Counter[tuple[str, str]] = Counter()
    mutants = []
    for start, end, text, function in sorted(finder.found):
        changed = source[:start] + text.encode() + source[end:]
        change = f"{_lines(source, start, end)} -> {_lines(changed, start, start + len(text.encode()))}"
        seen[function, change] += 1
        number = f" [{seen[function, change]}]" if seen[function, change] > 1 else ""
        line = 1 + source.count(b"\n", 0, start)
        mutants.append(
            Mutant(file=file, line=line, function=function, change=change + number, start=start, end=end, text=text)
        )
    return mutants


def _lines(source: bytes, start: int, end: int) -> str:
    """Return the lines that hold a place, as one line without its comment."""
    first = source.rfind(b"\n", 0, start) + 1
    last = source.find(b"\n", end)
    text = source[first : last if last >= 0 else len(source)].decode()
    return " ".join(re.sub(r"(?m)\s\s#.*$", "", text).split())


class _Finder(ast.NodeVisitor):
    """Collect (start, end, new text, function) of every change."""

    def __init__(self, source: bytes) -> None:
        self.source = source
        self.line_starts = [0, *(match.end() for match in re.finditer(b"\n", source))]
        self.inside: list[str] = []
        self.found: list[tuple[int, int, str, str]] = []

    def _start(self, node: ast.expr) -> int:
        return self.line_starts[node.lineno - 1] + node.col_offset

    def _end(self, node: ast.expr) -> int:
        return self.line_starts[(node.end_lineno or 1) - 1] + (node.end_col_offset or 0)

    def _add(self, start: int, end: int, text: str) -> None:
        self.found.append((start, end, text, ".".join(self.inside)))

    def _operator(self, start: int, end: int, old: str, new: str) -> None:
        """Replace an operator that stands between two places, perhaps with brackets and comments."""
        between = re.sub(rb"#[^\n]*", lambda comment: b" " * len(comment.group()), self.source[start:end])
        found = re.search(rb"\s+".join(re.escape(word).encode() for word in old.split()), between)
        if found:
            self._add(start + found.start(), start + found.end(), new)

    def visit_ClassDef(self, node: ast.ClassDef) -> None:
        self.inside.append(node.name)
        for each in node.body:
            self.visit(each)
        self.inside.pop()

    def visit_FunctionDef(self, node: ast.FunctionDef) -> None:
        if node.name in ("__repr__", "__str__"):
            return
        self.inside.append(node.name)
        for each in (*node.args.defaults, *node.args.kw_defaults, *node.body):
            if each is not None:
                self.visit(each)
        self.inside.pop()

    def visit_AnnAssign(self, node: ast.AnnAssign) -> None:
        if node.value is not None:
            self.visit(node.value)

    def visit_Raise(self, node: ast.Raise) -> None:
        """Leave messages as they are."""

    def visit_JoinedStr(self, node: ast.JoinedStr) -> None:
        """Leave messages as they are; Python 3.11 does not know the places inside, either."""

    def visit_If(self, node: ast.If) -> None:
        if ast.unparse(node.test) != "TYPE_CHECKING":
            self.generic_visit(node)

    def visit_keyword(self, node: ast.keyword) -> None:
        if node.arg != "strict":  # zip(..., strict=True) states what holds anyway
            self.visit(node.value)

    def visit_Compare(self, node: ast.Compare) -> None:
        operands = [node.left, *node.comparators]
        for left, operator, right in zip(operands, node.ops, operands[1:], strict=False):
            old = SYMBOLS[type(operator)]
            self._operator(self._end(left), self._start(right), old, COMPARISONS[old])
        self.generic_visit(node)

    def visit_BinOp(self, node: ast.BinOp) -> None:
        old = SYMBOLS.get(type(node.op))
        if old and not any(_is_text_or_type(side) for side in (node.left, node.right)):
            self._operator(self._end(node.left), self._start(node.right), old, ARITHMETIC[old])
        self.generic_visit(node)

    def visit_AugAssign(self, node: ast.AugAssign) -> None:
        old = SYMBOLS.get(type(node.op))
        if old and not _is_text_or_type(node.value):
            self._operator(self._end(node.target), self._start(node.value), f"{old}=", f"{ARITHMETIC[old]}=")
        self.generic_visit(node)

    def visit_BoolOp(self, node: ast.BoolOp) -> None:
        old, new = ("and", "or") if isinstance(node.op, ast.And) else ("or", "and")
        for left, right in zip(node.values, node.values[1:], strict=False):
            self._operator(self._end(left), self._start(right), old, new)
        self.generic_visit(node)

    def visit_UnaryOp(self, node: ast.UnaryOp) -> None:
        symbol = {ast.Not: rb"not\s*", ast.USub: rb"-\s*", ast.Invert: rb"~\s*"}.get(type(node.op))
        found = symbol and re.match(symbol, self.source[self._start(node) :])
        if found:
            self._add(self._start(node), self._start(node) + found.end(), "")
        self.generic_visit(node)

    def visit_Call(self, node: ast.Call) -> None:
        name = getattr(node.func, "id", None) or getattr(node.func, "attr", "")
        if name in FUNCTIONS:
            self._add(self._end(node.func) - len(name), self._end(node.func), FUNCTIONS[name])
        self.generic_visit(node)

    def visit_Constant(self, node: ast.Constant) -> None:
        for new in _other_values(node.value):
            self._add(self._start(node), self._end(node), repr(new))


def _other_values(value: object) -> Iterator[bool | int | float]:
    """Yield what a constant is replaced by: nothing for texts and None."""
    if isinstance(value, bool):
        yield not value
    elif isinstance(value, int):
        yield value + 1
        yield 2 * value if value >= LARGE else value - 1
    elif isinstance(value, float):
        yield 2 * value or 1.0
        if value:
            yield value / 2


def _is_text_or_type(node: ast.expr) -> bool:
    """Return True for a side of an operator that joins texts, lists or types."""
    if isinstance(node, ast.Constant):
        return node.value is None or isinstance(node.value, str | bytes)
    if isinstance(node, ast.BinOp):
        return _is_text_or_type(node.left) or _is_text_or_type(node.right)
    return isinstance(node, SEQUENCES) or (isinstance(node, ast.Name) and node.id in TYPES)
