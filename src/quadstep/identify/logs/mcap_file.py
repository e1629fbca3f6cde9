"""MCAP: messages of ROS 2, or in JSON."""

import io
import json
import zlib
from array import array
from collections.abc import Iterator, Sequence
from pathlib import Path

import lz4.frame
import numpy as np
import zstandard
from mcap.records import Channel, Chunk, McapRecord, Message, Schema
from mcap.stream_reader import StreamReader
from mcap_ros2.decoder import DecoderFactory

from quadstep.identify.logs.series import MOST_SAMPLES, Columns, Series, Topics, by_topic, refuse_many
from quadstep.io import files
from quadstep.io.errors import UserError

END = b"\x02" + (20).to_bytes(8, "little") + bytes(20) + b"\x89MCAP0\r\n"
"""The records that end a file."""


def read(path: Path, wanted: list[str]) -> Topics:
    """Columns of an MCAP file with messages of ROS 2 or in JSON, at the time they were logged, in the order of time.

    Raises UserError for too much data; other errors where a checksum is wrong.
    """
    fields = by_topic(wanted)
    content = files.read_bytes(path, files.LOG)
    sizes = [one.uncompressed_size for one in recorded(content) if isinstance(one, Chunk)]
    if sum(sizes) > files.LOG.most:
        most = f"at most {files.LOG.most / 1e6:g} MB"
        raise UserError(f"{path}: too large: it unpacks to {sum(sizes) / 1e6:.0f} MB; a log may have {most}, unpacked too")
    factory = DecoderFactory()
    schemas: dict[int, Schema] = {}
    channels: dict[int, Channel] = {}
    rows = {topic: array("d") for topic in fields}
    for one in unpacked(content):
        if isinstance(one, Schema):
            schemas[one.id] = one
        elif isinstance(one, Channel):
            channels[one.id] = one
        elif isinstance(one, Message) and (channel := channels[one.channel_id]).topic in rows:
            if channel.message_encoding == "json":
                message: object = json.loads(one.data)
            else:
                decode = factory.decoder_for(channel.message_encoding, schemas.get(channel.schema_id))
                if decode is None:
                    raise UserError(f"{path}: {channel.topic}: message encoding {channel.message_encoding} is not supported")
                message = decode(one.data)
            taken = rows[channel.topic]
            taken.append(one.log_time * 1e-9)
            taken.extend(entry(message, field) for field in fields[channel.topic])
            if len(taken) > MOST_SAMPLES:
                break
    widths = {topic: 1 + len(names) for topic, names in fields.items()}
    refuse_many(path, {topic: len(taken) // widths[topic] for topic, taken in rows.items()}, fields)
    found: Columns = {}
    for topic, taken in rows.items():
        if taken:
            values = np.frombuffer(taken).reshape(-1, widths[topic])
            time, *columns = values[np.argsort(values[:, 0], kind="stable")].T
            names = [f"{topic}.{field}" for field in fields[topic]]
            found.update({name: Series(time, column) for name, column in zip(names, columns, strict=True)})
    return Topics(found, 0)


def recorded(content: bytes, inside: bool = False) -> Iterator[McapRecord]:
    """The records of a file, its chunks packed. inside: whether it is what a chunk holds."""
    stream = io.BytesIO(content)
    yield from StreamReader(stream, inside, emit_chunks=True, validate_crcs=True, record_size_limit=len(content)).records


def unpacked(content: bytes) -> Iterator[McapRecord]:
    """The records of a file, those in its chunks too. Raises ValueError where a chunk's size or checksum is wrong."""
    for one in recorded(content):
        if isinstance(one, Chunk):
            yield from recorded(data_of(one) + END, inside=True)
        else:
            yield one


def data_of(chunk: Chunk) -> bytes:
    """What a chunk holds. Raises ValueError where that has not the size or checksum that the chunk says."""
    found, size = chunk.data, chunk.uncompressed_size
    if chunk.compression in ("zstd", "lz4"):  # read no further than it should go
        packed = io.BytesIO(found)
        stream = zstandard.ZstdDecompressor().stream_reader(packed) if chunk.compression == "zstd" else lz4.frame.open(packed)
        found = stream.read(size + 1)
    if len(found) != size or (chunk.uncompressed_crc and zlib.crc32(found) != chunk.uncompressed_crc):
        raise ValueError("the size or the checksum of a chunk is wrong")
    return found


def entry(message: object, field: str) -> float:
    """A number inside a message: pose.position.x, or control[2]; NaN where there is none."""
    for part in field.split("."):
        name, _, place = part.partition("[")
        message = message.get(name) if isinstance(message, dict) else getattr(message, name, None)
        if place and message is not None:
            index = int(place.rstrip("]"))
            message = message[index] if isinstance(message, Sequence) and index < len(message) else None
    return float(message) if isinstance(message, int | float) else float("nan")
