"""Writes the messages of MCAP files as other recordings, by PyPI `rosbags`: write_bags.py OUT FILE..

One bag NAME a file and form: `mcap`, `db3`, `file` and `message` (database compressed as a whole, message by message),
`mcap-file`, `mcap-message`, `old` (without definitions, as before Iron), `split` (two parts of one bag), and of ROS 1
`ros1`, `ros1-bz2`, `ros1-lz4`.
"""

import json
import pathlib
import sqlite3
import sys

from mcap.reader import make_reader
from rosbags import rosbag1
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

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
ROS1_FORMS = {
    "ros1": None,
    "ros1-bz2": rosbag1.Writer.CompressionFormat.BZ2,
    "ros1-lz4": rosbag1.Writer.CompressionFormat.LZ4,
}


def write_ros1(path, messages, compression):
    """The same messages in the wire format of ROS 1, whose headers count besides."""
    ros1, ros2 = get_typestore(Stores.ROS1_NOETIC), get_typestore(Stores.EMPTY)
    path.parent.mkdir(parents=True, exist_ok=True)
    writer = rosbag1.Writer(path)
    if compression is not None:
        writer.set_compression(compression)
    header = ros1.types["std_msgs/msg/Header"]

    def counted(message, sequence):
        if hasattr(message, "transforms"):
            for transform in message.transforms:
                counted(transform, sequence)
        elif hasattr(message, "header"):
            message.header = header(sequence, message.header.stamp, message.header.frame_id)
        return message

    with writer:
        connections = {}
        for sequence, (schema, channel, message) in enumerate(messages):
            if schema.name not in ros2.types:
                ros2.register(get_types_from_msg(schema.data.decode(), schema.name))
            if channel.topic not in connections:
                connections[channel.topic] = writer.add_connection(channel.topic, schema.name, typestore=ros1)
            read = counted(ros2.deserialize_cdr(message.data, schema.name), sequence)
            writer.write(connections[channel.topic], message.log_time, ros1.serialize_ros1(read, schema.name))


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
    for form, compression in ROS1_FORMS.items():
        write_ros1(out / form / f"{file.stem}.bag", messages, compression)
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
