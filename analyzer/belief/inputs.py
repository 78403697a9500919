"""Digest of all from which the beliefs of a night follow. It is stored with them, so that `store check` does not
compute them again."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime, timedelta
from hashlib import blake2b
from itertools import pairwise

from analyzer.config import Config
from analyzer.locations import content
from analyzer.store.store import SCHEMA, Store
from analyzer.store.table import mark_of

FOLLOWS = b"follows"
"""Metadata of a table of beliefs: the digest of their inputs."""
ENDED = timedelta(days=2)
"""Time after the midnight of its date at which a night has ended in every time zone."""


def inputs_of(
    store: Store, night: str, before: str | None, repaired: Mapping[str, Sequence[float]], config: Config
) -> str:
    """Digest of the files of a night and of the previous night's beliefs, of repairs noted until the night's end [s
    since 1970-01-01 UTC], and of the limits. Raises FileNotFoundError where a file is missing."""
    end_s = (datetime.fromisoformat(night).replace(tzinfo=UTC) + ENDED).timestamp()
    done = {loop: sorted(t for t in own if t < end_s) for loop, own in sorted(repaired.items())}
    found = blake2b(content(store.file("nights", night)), digest_size=16)
    if before is not None:
        found.update(content(store.file("beliefs", before)))
    values = [SCHEMA, {k: v for k, v in done.items() if v}, repr(config.belief), repr(config.wear)]
    found.update(json.dumps(values).encode())
    return found.hexdigest()


def has_inputs(
    store: Store, night: str, before: str | None, repaired: Mapping[str, Sequence[float]], config: Config
) -> bool:
    """Whether the beliefs of a night carry the digest of their present inputs."""
    try:
        return mark_of(store.file("beliefs", night), FOLLOWS) == inputs_of(
            store, night, before, repaired, config
        )
    except FileNotFoundError:
        return False


def all_have_inputs(
    store: Store, names: Sequence[str], repaired: Mapping[str, Sequence[float]], config: Config
) -> bool:
    """Whether the beliefs of all nights between the oldest and the newest carry the digest of their inputs. The
    digest of the second one includes the oldest one's beliefs."""
    pairs = pairwise(names[:-1])
    return all(has_inputs(store, night, before, repaired, config) for before, night in pairs)
