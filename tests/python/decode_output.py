"""Decodes every message of an MCAP with the Python packages; prints one JSON line with the counts by topic.

usage: decode_output.py run.mcap
"""
import json
import sys
from collections import Counter

from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory as Protobuf
from mcap_ros2.decoder import DecoderFactory as Ros2

counts, schemas = Counter(), {}
with open(sys.argv[1], "rb") as stream:
    reader = make_reader(stream, decoder_factories=[Protobuf(), Ros2()], validate_crcs=True)
    summary = reader.get_summary()
    for schema, channel, message, decoded in reader.iter_decoded_messages():
        assert decoded is not None
        counts[channel.topic] += 1
        schemas[channel.topic] = schema.name
    attachments = sorted(a.name for a in reader.iter_attachments())
    metadata = sorted(m.name for m in reader.iter_metadata())
assert sum(counts.values()) == summary.statistics.message_count
print(json.dumps({"counts": counts, "schemas": schemas, "attachments": attachments, "metadata": metadata}))
