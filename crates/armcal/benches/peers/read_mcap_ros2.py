"""Two streams of a recording into columns by `mcap` and `mcap_ros2`: read_mcap_ros2.py FILE -> one JSON line."""
import json
import sys
import time

from columns import JOINTS, TIP, Columns
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

wall_s, cpu_s = time.perf_counter(), time.process_time()
columns = Columns()
with open(sys.argv[1], "rb") as file:
    reader = make_reader(file, decoder_factories=[DecoderFactory()])
    # File order: sorting by log time would only cost the peer time.
    for _, channel, _, message in reader.iter_decoded_messages(topics=[JOINTS, TIP], log_time_order=False):
        columns.add(channel.topic, message)
columns.finish()
spent = {"wall_s": time.perf_counter() - wall_s, "cpu_s": time.process_time() - cpu_s}
print(json.dumps({**spent, **columns.facts()}))
