"""Extreme values of numbers, words and documents, and functions that corrupt a text or a file with them."""

import json
import random
import re
from typing import Any

WORDS = (
    "0", "-0", "1", "-1", "2", "7", "0.5", "-0.5", "1e-3", "1e3", "1e-6", "1e6", "-1e6", "1e-14", "1e12", "1e13",
    "1e-30", "1e-31", "nan", "-nan", "inf", "-inf", "1e308", "-1e308", "1e-308", "5e-324", "1e200", "-1e200", "1e-200",
    "1e400", "9" * 20, "9" * 400, "-" + "9" * 400, "9" * 5000, str(2**31), str(2**53 + 1), str(2**63), str(2**64),
    "1000000", "1000000000", "", " ", "abc", "1,5", "0x10", "1_000", "½", "१", "∞", "µ", "%s", "{}", "a" * 3000, ".",
    "..", "/", "-", "--", "é", "日本", "\udce9", "\u202e", "True", "None", "null", "[1, 2]", "1:2:3", "1:2", ":::",
    "=", "==", "1=2", "'", '"', "\\", "\n", "\t", "single", "torsional", "full", "up", "fixed",
)

VALUES: tuple[Any, ...] = (
    None, True, False, 0, -1, 1, 2, 77777, 2**31, 2**63, 2**70, 10**400, 0.5, -0.5, 1e308, -1e308, 5e-324,
    float("nan"), float("inf"), "", "words",
    "NaN", "1", "../..", "a" * 3000, "\u0000", "日本", [], [1], [0, 0], [-1], [None], [1e308, 3],
    {}, {"a": 1}, {"": None},
)

_TOKEN = re.compile(r"[\w.+-]+|\s+|.", re.DOTALL)


def corrupted_text(text: str, rng: random.Random) -> str:
    """A text with one to four of its tokens replaced, duplicated, swapped or deleted."""
    tokens = _TOKEN.findall(text)
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        if not tokens:
            break
        i, j = rng.randrange(len(tokens)), rng.randrange(len(tokens))
        match rng.randrange(8):
            case 0:
                del tokens[i]
            case 1:
                tokens.insert(i, tokens[j])
            case 2:
                tokens[i], tokens[j] = tokens[j], tokens[i]
            case 3:
                tokens.insert(i, rng.choice(WORDS))
            case _:
                numbers = [k for k, token in enumerate(tokens) if re.match(r"[\w.+-]", token)] or [i]
                tokens[rng.choice(numbers)] = rng.choice(WORDS)
    return "".join(tokens)


def corrupted_bytes(content: bytes, rng: random.Random) -> bytes:
    """Bytes truncated, partly overwritten with noise, replaced by noise, emptied or given a wrong encoding mark."""
    at = rng.randrange(len(content) + 1)
    noise = bytes(rng.randrange(256) for _ in range(rng.randrange(40)))
    return rng.choice((content[:at], content[:at] + noise + content[at + 1 :], noise, b"", b"\xff\xfe" + content))


def corrupted_json(text: str, rng: random.Random) -> str:
    """A JSON document with one value replaced, renamed or deleted."""
    document = json.loads(text)
    places = list(_places(document))
    if not places:
        return json.dumps(rng.choice(VALUES))
    holder, key = rng.choice(places)
    match rng.randrange(5):
        case 0:
            del holder[key]
        case 1 if isinstance(holder, dict):
            holder[rng.choice(("", "words", "../../x", str(key).upper()))] = holder.pop(key)
        case _:
            holder[key] = rng.choice(VALUES)
    return json.dumps(document)


def _places(document: Any) -> Any:
    """Every value of a document, as its container and its key or index there."""
    keys = {dict: list, list: lambda entries: range(len(entries))}.get(type(document), lambda _: ())(document)
    for key, value in [(key, document[key]) for key in keys]:
        yield document, key
        yield from _places(value)
