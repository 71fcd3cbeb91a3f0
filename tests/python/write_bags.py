"""Writes the messages of MCAP files as other recordings, by PyPI `rosbags`: write_bags.py OUT FILE..

One bag NAME a file and form: `mcap`, `db3`, `file` and `message` (database compressed as a whole, message by message),
`mcap-file`, `mcap-message`, `old` (without definitions, as before Iron), `split` (two parts of one bag).
"""

import json
import pathlib
import sqlite3
import sys

from mcap.reader import make_reader
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer

SQLITE, MCAP = StoragePlugin.SQLITE3, StoragePlugin.MCAP
FORMS = {
    "mcap": (MCAP, None),
    "db3": (SQLITE, None),
    "file": (SQLITE, CompressionMode.FILE),
    "message": (SQLITE, CompressionMode.MESSAGE),
    "mcap-file": (MCAP, CompressionMode.FILE),
    "mcap-message": (MCAP, CompressionMode.MESSAGE),
    "old": (SQLITE, None),
}


def write(path, messages, plugin, mode):
    path.parent.mkdir(parents=True, exist_ok=True)
    writer = Writer(path, version=9, storage_plugin=plugin)
    if mode is not None:
        writer.set_compression(mode, CompressionFormat.ZSTD)
    with writer:
        connections = {}
        for schema, channel, message in messages:
            if channel.topic not in connections:
                connections[channel.topic] = writer.add_connection(
                    channel.topic, schema.name, msgdef=schema.data.decode(), rihs01="RIHS01_0"
                )
            writer.write(connections[channel.topic], message.log_time, message.data)


out = pathlib.Path(sys.argv[1])
counts = {}
for file in map(pathlib.Path, sys.argv[2:]):
    with open(file, "rb") as stream:
        messages = list(make_reader(stream).iter_messages())
    counts[file.stem] = len(messages)
    for form, (plugin, mode) in FORMS.items():
        write(out / form / file.stem, messages, plugin, mode)
    database = sqlite3.connect(out / "old" / file.stem / f"{file.stem}.db3")
    database.executescript("DROP TABLE message_definitions; VACUUM;")
    database.close()
    # A split bag: the second part goes on where the first ends.
    half = len(messages) // 2
    split = out / "split" / file.stem
    write(split, messages[:half], SQLITE, None)
    write(out / "second" / file.stem, messages[half:], SQLITE, None)
    (split / f"{file.stem}.db3").rename(split / f"{file.stem}_0.db3")
    (out / "second" / file.stem / f"{file.stem}.db3").rename(split / f"{file.stem}_1.db3")
print(json.dumps(counts))
