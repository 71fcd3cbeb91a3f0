"""Two streams of a recording into columns by `rosbags`: read_rosbags.py FILE -> one JSON line."""
import json
import sys
import time
from pathlib import Path

from columns import JOINTS, TIP, Columns
from rosbags.highlevel import AnyReader

wall_s, cpu_s = time.perf_counter(), time.process_time()
columns = Columns()
with AnyReader([Path(sys.argv[1])]) as reader:
    wanted = [c for c in reader.connections if c.topic in (JOINTS, TIP)]
    for connection, _, raw in reader.messages(connections=wanted):
        columns.add(connection.topic, reader.deserialize(raw, connection.msgtype))
columns.finish()
spent = {"wall_s": time.perf_counter() - wall_s, "cpu_s": time.process_time() - cpu_s}
print(json.dumps({**spent, **columns.facts()}))
