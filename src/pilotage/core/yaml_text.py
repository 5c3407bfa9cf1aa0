"""YAML as it was meant, read so that no text can hang or swell the program.

A key that is given twice is a mistake, not the last one's victory; values are plain ones (no tags of one's
own); lists and mappings lie at most ``DEPTH`` deep inside one another, and what aliases stand for counts as
if it were written out.
"""

from __future__ import annotations

import re
from typing import Any, ClassVar

import yaml

from pilotage.core.errors import InputError
from pilotage.core.limits import DEPTH, NUMBER_LENGTH, VALUES, limit, too_large

_PARSER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_UNKNOWN_TAG = re.compile(r"could not determine a constructor for the tag '(?:tag:yaml\.org,2002:|!)?(.*)'")
_HALF_PAIR = re.compile("[\ud800-\udfff]")
_NUMBERS = frozenset({"tag:yaml.org,2002:int", "tag:yaml.org,2002:float"})
_TRUTH = "tag:yaml.org,2002:bool"
_NO_NAMES = frozenset({_TRUTH, "tag:yaml.org,2002:null", "tag:yaml.org,2002:timestamp"})
# What PyYAML's constructors stumble over where a tag and its text do not belong together.
_MISFITS = (TypeError, LookupError, AttributeError)


def load_yaml(text: str, where: str) -> Any:
    """Parse YAML text.

    Parameters
    ----------
    where
        What the text is, such as a file's name; the error begins with it.

    Raises
    ------
    InputError
        One line with the line number, where it is no YAML, a mapping has a key twice, or there is more in
        it than the limits of ``core.files`` allow.
    """
    try:
        node = _Composer(text, where).node()
        return None if node is None else _Constructor().construct_document(node)
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        # The C parser counts one line more at the end of the text.
        line = f" line {min(mark.line, text.count(chr(10))) + 1}" if mark is not None else ""
        problem = getattr(error, "problem", None) or str(error) or "not YAML"
        if mark is not None and text[mark.index : mark.index + 1] == "\t":
            problem = "a tab where YAML takes spaces"
        problem = _UNKNOWN_TAG.sub(r"the tag '!!\1', which has no meaning here", problem)
        raise InputError(f"{where}{line}: expected YAML, found: {problem}") from None
    except (ValueError, OverflowError) as error:  # a date that is none
        raise InputError(f"{where}: expected YAML, found: {error}") from None
    except _MISFITS:
        raise InputError(f"{where}: expected YAML, found a tag that its value does not fit") from None


class _Constructor(yaml.constructor.SafeConstructor):
    """Plain values from nodes: what JSON knows, and dates; a set, for one, would have no order."""

    yaml_constructors: ClassVar[dict[Any, Any]] = {
        tag: constructor
        for tag, constructor in yaml.constructor.SafeConstructor.yaml_constructors.items()
        if tag is None or tag.rpartition(":")[2] not in ("set", "omap", "pairs", "binary")
    }


def _problem(text: str, place: Any) -> yaml.MarkedYAMLError:
    return yaml.MarkedYAMLError(problem=text, problem_mark=place.start_mark)


def _as_key(node: yaml.Node) -> yaml.Node:
    """A key as it is written: YAML 1.1 reads `on`, `no` and `null` as no names, and parameters have such."""
    if isinstance(node, yaml.ScalarNode) and node.tag in _NO_NAMES and node.value:
        return yaml.ScalarNode("tag:yaml.org,2002:str", node.value, node.start_mark, node.end_mark)
    return node


class _Weight:
    """What a node amounts to with its aliases written out: how many values, and how deep."""

    __slots__ = ("count", "height")

    def __init__(self) -> None:
        self.count = 1
        self.height = 0

    def add(self, inner: _Weight) -> None:
        self.count += inner.count
        self.height = max(self.height, inner.height + 1)


class _Composer:
    """Nodes from the parser's events, without recursion and with an eye on what they amount to."""

    def __init__(self, text: str, where: str) -> None:
        self._where = where
        self._most = limit(VALUES)
        self._events = yaml.parse(_HALF_PAIR.sub("\N{REPLACEMENT CHARACTER}", text), Loader=_PARSER)
        self._resolver: Any = yaml.resolver.Resolver()
        self._anchors: dict[str, tuple[yaml.Node, _Weight]] = {}
        self._total = 0

    def node(self) -> yaml.Node | None:
        """The one document's root; None where there is none.

        Raises
        ------
        yaml.YAMLError
            Where it is no YAML, or holds a second document.
        InputError
            Where it is too much.
        """
        # Each open collection: its node, its weight, the anchor that it has, and a mapping's waiting key.
        open_: list[tuple[yaml.CollectionNode, _Weight]] = []
        keys: list[yaml.Node | None] = []
        seen: list[set[tuple[str, str]]] = []
        root: yaml.Node | None = None
        node: yaml.Node
        for event in self._events:
            if isinstance(event, yaml.ScalarEvent):
                node, weight = self._scalar(event), _Weight()
                if event.anchor is not None:
                    self._anchors[event.anchor] = node, weight
            elif isinstance(event, yaml.CollectionStartEvent):
                if len(open_) >= DEPTH:
                    raise self._too_deep(event)
                collection = self._collection(event)
                weight = _Weight()
                open_.append((collection, weight))
                keys.append(None)
                seen.append(set())
                if event.anchor is not None:
                    self._anchors[event.anchor] = collection, weight
                self._count(1)
                continue
            elif isinstance(event, yaml.CollectionEndEvent):
                node, weight = open_.pop()
                keys.pop()
                seen.pop()
            elif isinstance(event, yaml.AliasEvent):
                node, weight = self._alias(event, [inner for inner, _ in open_])
                if len(open_) + weight.height > DEPTH:
                    raise self._too_deep(event)
                self._count(weight.count)
            elif isinstance(event, yaml.DocumentStartEvent) and root is not None:
                raise _problem("a second document; expected one", event)
            else:
                continue
            if not open_:
                root = node
                continue
            around, outer = open_[-1]
            outer.add(weight)
            if isinstance(around, yaml.SequenceNode):
                around.value.append(node)
            elif keys[-1] is None:
                node = _as_key(node)
                self._once(node, seen[-1])
                keys[-1] = node
            else:
                around.value.append((keys[-1], node))
                keys[-1] = None
        return root

    def _scalar(self, event: Any) -> yaml.ScalarNode:
        self._count(1)
        tag = event.tag
        if tag is None or tag == "!":
            tag = self._resolver.resolve(yaml.ScalarNode, event.value, event.implicit)
        if event.tag is None and (
            (tag in _NUMBERS and ":" in event.value)  # YAML 1.1 counted in sixties
            or (
                tag == _TRUTH and event.value.lower() not in ("true", "false")
            )  # and took `on` and `no` for one
        ):
            tag = "tag:yaml.org,2002:str"
        if tag in _NUMBERS and len(event.value) > NUMBER_LENGTH:
            raise _problem(f"a number of {len(event.value)} characters", event)
        return yaml.ScalarNode(tag, event.value, event.start_mark, event.end_mark, style=event.style)

    def _collection(self, event: Any) -> yaml.CollectionNode:
        kind = yaml.SequenceNode if isinstance(event, yaml.SequenceStartEvent) else yaml.MappingNode
        tag = event.tag
        if tag is None or tag == "!":
            tag = self._resolver.resolve(kind, None, event.implicit)
        return kind(tag, [], event.start_mark, None, flow_style=event.flow_style)

    def _alias(self, event: Any, around: list[yaml.CollectionNode]) -> tuple[yaml.Node, _Weight]:
        if event.anchor not in self._anchors:
            raise _problem(f"the alias '{event.anchor}' of nothing", event)
        node, weight = self._anchors[event.anchor]
        if any(node is outer for outer in around):
            raise _problem(f"'{event.anchor}' inside itself", event)
        return node, weight

    def _count(self, values: int) -> None:
        self._total += values
        if self._total > self._most:
            raise too_large(f"{self._where} (aliases written out)", self._most, None, "values")

    def _too_deep(self, event: Any) -> InputError:
        return InputError(
            f"{self._where} line {event.start_mark.line + 1}: expected lists and mappings at most {DEPTH} "
            "deep inside one another, found deeper ones"
        )

    @staticmethod
    def _once(key: yaml.Node, seen: set[tuple[str, str]]) -> None:
        """Look at the keys as they are written, before `<<` lays other mappings under them."""
        if not isinstance(key, yaml.ScalarNode) or key.tag == "tag:yaml.org,2002:merge":
            return
        if (key.tag, key.value) in seen:
            raise _problem(f"the key '{key.value}' twice in one mapping", key)
        seen.add((key.tag, key.value))
