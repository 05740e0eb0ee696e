"""Which column and row of a grid each element of one container gets; tokens flow to the right."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from m2pem.mission.reachability import components


@dataclass(frozen=True, slots=True)
class Link:
    """A line from `source` to `target`. `at`: whose cell it leaves from, the source's own or, of a
    boundary event, its activity's; that one it leaves `below`."""

    id: str
    source: str
    target: str
    at: str

    @property
    def below(self) -> bool:
        """Whether it leaves downwards."""
        return self.at != self.source


@dataclass(slots=True)
class Grid:
    """`cells`: column and row of each element; `ways`: the rows in which a link passes the columns
    between its ends. A link to the same or an earlier column is in `back`."""

    cells: dict[str, tuple[int, int]] = field(default_factory=dict)
    ways: dict[str, list[int]] = field(default_factory=dict)
    back: set[str] = field(default_factory=set)
    lane_rows: list[tuple[int, int]] = field(default_factory=list)

    @property
    def columns(self) -> int:
        """The number of them."""
        return max((column for column, _ in self.cells.values()), default=-1) + 1

    @property
    def rows(self) -> int:
        """The number of them."""
        rows = [row for _, row in self.cells.values()]
        rows += [row for way in self.ways.values() for row in way]
        return max(rows, default=-1) + 1


def arrange(
    nodes: Sequence[str], links: Sequence[Link], lanes: Mapping[str, int] | None = None
) -> Grid:
    """Place `nodes`, each in the rows of its lane; what is not connected is placed below."""
    lanes = lanes or {}
    grid = Grid(back=_backward(nodes, links))
    forward = [link for link in links if link.id not in grid.back]
    columns = _columns(nodes, forward)
    rows = _Rows(lanes)
    for component in _components(nodes, links):
        _place(component, columns, forward, rows)
    top: list[int] = []
    start = 0
    for height in rows.heights():
        top.append(start)
        grid.lane_rows.append((start, start + height))
        start += height
    for node in nodes:
        grid.cells[node] = (columns[node], top[lanes.get(node, 0)] + rows.of[node])
    for link in forward:
        lane = lanes.get(link.at, 0)
        between = range(columns[link.at] + 1, columns[link.target])
        grid.ways[link.id] = [top[lane] + rows.of[f"{link.id}@{column}"] for column in between]
    return grid


def _backward(nodes: Sequence[str], links: Sequence[Link]) -> set[str]:
    """The links that close a circle, as a walk from the elements without a way in finds them."""
    outgoing: dict[str, list[Link]] = {node: [] for node in nodes}
    for link in links:
        outgoing[link.at].append(link)
    entered = {link.target for link in links}
    back: set[str] = set()
    done: set[str] = set()
    for root in [n for n in nodes if n not in entered] + list(nodes):
        if root in done:
            continue
        path = {root: iter(outgoing[root])}
        while path:
            node = next(reversed(path))
            way = next(path[node], None)
            if way is None:
                done.add(node)
                del path[node]
            elif way.target in path:
                back.add(way.id)
            elif way.target not in done:
                path[way.target] = iter(outgoing[way.target])
    return back


def _columns(nodes: Sequence[str], links: Sequence[Link]) -> dict[str, int]:
    columns = dict.fromkeys(nodes, 0)
    for _ in nodes:
        moved = False
        for link in links:
            if columns[link.target] <= columns[link.at]:
                columns[link.target] = columns[link.at] + 1
                moved = True
        if not moved:
            break
    return columns


def _components(nodes: Sequence[str], links: Sequence[Link]) -> list[list[str]]:
    beside: dict[str, list[str]] = {node: [] for node in nodes}
    for link in links:
        beside[link.at].append(link.target)
        beside[link.target].append(link.at)
    number = components(beside)
    found: dict[int, list[str]] = {}
    for node in nodes:
        found.setdefault(number[node], []).append(node)
    return list(found.values())


class _Rows:
    """The rows that are taken, lane by lane, each counted from the lane's own top."""

    def __init__(self, lanes: Mapping[str, int]) -> None:
        self.lanes = lanes
        self.of: dict[str, int] = {}
        self._taken: set[tuple[int, int, int]] = set()
        self._tops = [0] * (max(lanes.values(), default=0) + 1)

    def begin(self) -> None:
        """What is placed from now on lies below all that was placed."""
        self._tops = self.heights()

    def heights(self) -> list[int]:
        heights = [1] * len(self._tops) if len(self._tops) > 1 else [0]
        for _, lane, row in self._taken:
            heights[lane] = max(heights[lane], row + 1)
        return heights

    def put(self, item: str, column: int, lane: int, wanted: int | None) -> None:
        row = max(self._tops[lane], wanted if wanted is not None else 0)
        while (column, lane, row) in self._taken:
            row += 1
        self._taken.add((column, lane, row))
        self.of[item] = row


def _place(
    component: Sequence[str], columns: Mapping[str, int], links: Iterable[Link], rows: _Rows
) -> None:
    rows.begin()
    inside = set(component)
    mine = [link for link in links if link.at in inside]
    for column in range(max(columns[node] for node in component) + 1):
        wanted_rows: list[tuple[float, int, str, int, int | None]] = []
        for order, node in enumerate(n for n in component if columns[n] == column):
            lane = rows.lanes.get(node, 0)
            wanted = _wanted_row(node, lane, mine, columns, rows)
            wanted_rows.append((wanted if wanted is not None else -1, order, node, lane, wanted))
        for order, link in enumerate(mine):
            if columns[link.at] < column < columns[link.target]:
                before = f"{link.id}@{column - 1}"
                row = rows.of.get(before)
                if row is None:
                    row = rows.of[link.at] + _fan(link, mine)
                lane = rows.lanes.get(link.at, 0)
                wanted_rows.append((row, order + 1000, f"{link.id}@{column}", lane, row))
        for _, _, item, lane, wanted in sorted(wanted_rows):
            rows.put(item, column, lane, wanted)


def _wanted_row(
    node: str, lane: int, links: Sequence[Link], columns: Mapping[str, int], rows: _Rows
) -> int | None:
    """The row of the first that leads here; a fork's branches spread downwards."""
    wanted_rows = [
        rows.of.get(f"{link.id}@{columns[node] - 1}", rows.of[link.at] + _fan(link, links))
        for link in links
        if link.target == node and rows.lanes.get(link.at, 0) == lane
    ]
    return min(wanted_rows, default=None)


def _fan(link: Link, links: Sequence[Link]) -> int:
    siblings = [each for each in links if each.at == link.at and not each.below]
    below = [each for each in links if each.at == link.at and each.below]
    return (siblings + below).index(link) + (link.below and not siblings)
