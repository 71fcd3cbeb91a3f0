"""Resolves every path of a run's Foxglove layouts in its MCAP, and checks the layouts' keys; prints one JSON line.

usage: check_layouts.py OUT   (a folder with run.mcap, foxglove-layout.json and foxglove-layout-legacy.json)

The grammar is what Foxglove and Lichtblick share: /topic.field[slice].field, no functions and no filters.
"""
import json
import math
import re
import sys
from collections import Counter, defaultdict
from pathlib import Path
from xml.etree import ElementTree

from google.protobuf.descriptor import FieldDescriptor
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from mcap_ros2.decoder import DecoderFactory as Ros2DecoderFactory

TOPIC = r'(/[A-Za-z0-9_\-]+(?:/[A-Za-z0-9_\-]+)*|"(?:[^"\\]|\\["\\])*")'
FIELD = r'\.([A-Za-z0-9_]+)(?:\[(-?\d+|-?\d*:-?\d*)\])?'
PLOT = {"paths", "xAxisVal", "xAxisPath", "xAxisLabel", "yAxisLabel", "isSynced", "showLegend", "legendDisplay",
        "showPlotValuesInLegend", "showXAxisLabels", "showYAxisLabels", "minYValue", "maxYValue"}
SERIES = {"value", "enabled", "label", "color", "timestampMethod", "showLine", "lineSize"}
VIEW = {"cameraState", "followTf", "followMode", "scene", "transforms", "topics", "layers"}
CAMERA = {"perspective", "distance", "phi", "thetaOffset", "targetOffset", "target", "targetOrientation", "fovy", "near",
          "far"}
KEYS = {
    "Plot": PLOT,
    "ThreeDee": VIEW,
    "Table": {"topicPath"},
    "RawMessages": {"topicPath", "diffEnabled", "expansion"},
    "Indicator": {"path", "style", "rules", "fallbackColor", "fallbackLabel"},
}
LEGACY_NAME = {"3D": "ThreeDee"}
NUMBERS = {FieldDescriptor.CPPTYPE_INT32, FieldDescriptor.CPPTYPE_INT64, FieldDescriptor.CPPTYPE_UINT32,
           FieldDescriptor.CPPTYPE_UINT64, FieldDescriptor.CPPTYPE_DOUBLE, FieldDescriptor.CPPTYPE_FLOAT}


DRAWN = {"foxglove.SceneUpdate", "foxglove.PosesInFrame", "foxglove.PoseInFrame", "foxglove.PointCloud"}


def read(path):
    """Messages, schema names, attachments, texts of robots, and the time of the first message, by topic and ("") of all."""
    messages, texts, times = defaultdict(list), {}, {}
    with open(path, "rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory(), Ros2DecoderFactory()], validate_crcs=True)
        schemas = {c.topic: reader.get_summary().schemas.get(c.schema_id) for c in reader.get_summary().channels.values()}
        # Where a viewer opens the file: at the first message of all, also of the recording itself.
        times[""] = reader.get_summary().statistics.message_start_time
        for _, channel, message, decoded in reader.iter_decoded_messages(topics=[t for t in schemas if t.startswith("/armcal/")]):
            times.setdefault(channel.topic, message.log_time)
            if channel.topic.endswith("/robot_description"):
                texts[channel.topic] = decoded.data
            else:
                messages[channel.topic].append(decoded)
        attached = {a.name: a.data for a in reader.iter_attachments()}
    return messages, {t: s.name for t, s in schemas.items() if s}, attached, texts, times


class Resolver:
    def __init__(self, messages, texts, times):
        self.messages, self.texts, self.times = messages, texts, times
        self.used = Counter()

    def resolve(self, path):
        """The values of the path in each message, the type of its end, and whether it is an array."""
        match = re.fullmatch(f"{TOPIC}((?:{FIELD})*)", path)
        assert match, f"{path} is not in the common grammar"
        topic = match[1]
        if topic.startswith('"'):
            topic = re.sub(r"\\(.)", r"\1", topic[1:-1])
        assert self.messages.get(topic), f"{path}: no message on {topic}"
        # Nothing would be drawn until somebody plays the file.
        assert self.times[topic] == self.times[""], f"{path}: nothing at the first instant"
        self.used[path] += 1
        descriptor, many, kind = self.messages[topic][0].DESCRIPTOR, False, None
        values = [[m] for m in self.messages[topic]]
        for field, bounds in re.findall(FIELD, match[2]):
            assert descriptor is not None, f"{path}: .{field} of something that has no fields"
            assert field in descriptor.fields_by_name, f"{path}: {descriptor.full_name} has no {field}"
            f = descriptor.fields_by_name[field]
            values = [[getattr(v, field) for v in of if not f.has_presence or v.HasField(field)] for of in values]
            if bounds:
                assert f.is_repeated, f"{path}: {field} is no array"
                if ":" in bounds:
                    assert not many, f"{path}: an array of arrays"
                    many = True
                    first, last = (int(b) if b else None for b in bounds.split(":"))
                    # Inclusive at both ends, as the applications have it.
                    last = None if last is None or last == -1 else last + 1
                    values = [[x for v in of for x in v[first:last]] for of in values]
                else:
                    assert all(len(v) > int(bounds) for of in values for v in of), f"{path}: too short"
                    values = [[v[int(bounds)] for v in of] for of in values]
                kind = f
            else:
                kind = f
            descriptor = f.message_type
        return values, kind, many, bool(kind is not None and kind.is_repeated and not bounds)

    def numbers(self, path, array):
        values, kind, many, whole = self.resolve(path)
        assert kind is not None and kind.cpp_type in NUMBERS and not whole, f"{path} is no number"
        assert many == array, f"{path}: {'a number' if array else 'an array'} where the plot needs the other"
        flat = [v for of in values for v in of]
        assert any(math.isfinite(v) for v in flat), f"{path} has nothing to draw"
        assert not any(math.isinf(v) for v in flat), path
        return values

    def plot(self, config):
        assert set(config) <= PLOT, set(config) - PLOT
        # Against time a plot of real recordings shows the days between them.
        assert config["xAxisVal"] == "currentCustom"
        # A floating legend lies over the data and one at a side takes their place: the title says which colour is what.
        assert config["legendDisplay"] == "none" and config["showLegend"] is False
        x = self.numbers(config["xAxisPath"]["value"], True)
        for series in config["paths"]:
            assert set(series) == SERIES, series
            try:
                float(series["value"])
                continue
            except ValueError:
                pass
            y = self.numbers(series["value"], True)
            assert [len(v) for v in y] == [len(v) for v in x], f"{series['value']}: not as many as x"
            assert series["value"].split(".")[0] == config["xAxisPath"]["value"].split(".")[0], "two messages"
        assert config["paths"], "an empty plot"

    def panel(self, kind, config, schemas, frames):
        assert set(config) <= KEYS[kind], f"{kind}: {set(config) - KEYS[kind]}"
        if kind == "Plot":
            self.plot(config)
        elif kind == "Table":
            # A path that ends in [:] shows the first row only; an empty array says that it waits for a message.
            values, field, many, whole = self.resolve(config["topicPath"])
            assert field.message_type is not None and whole and not many, f"{config['topicPath']} is no table"
            assert len(values[0][0]) > 0, f"{config['topicPath']} is empty"
            # The columns are those of the first row.
            columns = {f.name for f, _ in values[0][0][0].ListFields() if f.has_presence}
            more = {f.name for row in values[0][0] for f, _ in row.ListFields() if f.has_presence} - columns
            assert not more, f"{config['topicPath']}: no column {more}"
        elif kind == "RawMessages":
            values, _, _, whole = self.resolve(config["topicPath"])
            assert not whole or len(values[0][0]) > 0, f"{config['topicPath']} is empty"
        elif kind == "Indicator":
            values, field, many, whole = self.resolve(config["path"])
            assert field.cpp_type == FieldDescriptor.CPPTYPE_STRING and not many and not whole
            assert all(set(r) == {"rawValue", "operator", "color", "label"} for r in config["rules"])
            colour = {r["rawValue"]: r["color"] for r in config["rules"]}
            assert values[0][0] in colour, values
            # What must not be relied upon is red, and nothing else is.
            bad = {"inadequate", "data_lost", "unexplained", "setup"}
            assert {v for v, c in colour.items() if c == colour["inadequate"]} == bad, colour
        elif kind == "ThreeDee":
            assert set(config["cameraState"]) == CAMERA
            assert config["followTf"] in frames, f"no frame {config['followTf']}"
            assert any(t["visible"] for t in config["topics"].values())
            # `transforms.visible` is no key of the viewers: these are, and without them every frame has a name and axes.
            transforms = config["scene"]["transforms"]
            assert transforms == {"showLabel": False, "axisScale": 0, "lineWidth": 0, "enablePreloading": True}
            for topic, settings in config["topics"].items():
                assert self.messages.get(topic), f"nothing on {topic}"
                assert schemas[topic] in DRAWN, topic
                if schemas[topic] == "foxglove.PoseInFrame":
                    assert settings["axisScale"] <= 0.05, "axes of a metre"
                if schemas[topic] == "foxglove.PointCloud":
                    fields = {f.name for m in self.messages[topic] for f in m.fields}
                    assert settings["colorMode"] == "rgba-fields"
                    assert {"x", "y", "z", "red", "green", "blue", "alpha"} <= fields, fields
                # The measured tip is not there before it was seen.
                if settings["visible"] and schemas[topic] != "foxglove.PoseInFrame":
                    assert self.times[topic] == self.times[""], f"{topic}: nothing at the first instant"
                if schemas[topic] == "foxglove.SceneUpdate":
                    assert settings["showOutlines"] is False, f"{topic}: black edges bury small arrows"
            for layer in config["layers"].values():
                assert layer["layerId"] == "foxglove.Urdf" and layer["sourceType"] == "topic", layer
                links = {link.get("name") for link in ElementTree.fromstring(self.texts[layer["topic"]]).findall("link")}
                assert links and {layer["framePrefix"] + link for link in links} <= frames, links - frames


def current(layout):
    """Panels of the current format: type, title, settings."""
    assert set(layout) == {"version", "variables", "userScripts", "content"} and layout["version"] == 1

    def walk(node):
        if node["type"] == "panel":
            assert set(node) == {"type", "panelType", "title", "version", "config"} and node["version"] == 1
            yield node["panelType"], node["title"], node["config"]
        elif node["type"] == "split":
            assert set(node) == {"type", "direction", "items"} and node["direction"] in {"row", "column"} and node["items"]
            for item in node["items"]:
                assert set(item) == {"proportion", "content"} and item["proportion"] > 0
                yield from walk(item["content"])
        else:
            assert node["type"] == "tabs" and set(node) == {"type", "selectedTabIndex", "tabs"} and node["tabs"]
            for tab in node["tabs"]:
                assert set(tab) == {"title", "content"}
                yield from walk(tab["content"])

    return list(walk(layout["content"]))


def legacy(layout):
    """Panels of the legacy format, in the order of its tree; every panel stands in it once."""
    assert set(layout) == {"configById", "globalVariables", "userNodes", "playbackConfig", "layout"}
    panels = dict(layout["configById"])

    def walk(node):
        if isinstance(node, str):
            config = dict(panels.pop(node))
            kind = node.split("!")[0]
            if kind == "Tab":
                assert set(config) == {"activeTabIdx", "tabs"}
                for tab in config["tabs"]:
                    assert set(tab) == {"title", "layout"}
                    yield from walk(tab["layout"])
                return
            # Foxglove Studio reads the one, Lichtblick the other.
            title = config.pop("foxglovePanelTitle")
            assert config.pop("lichtblickPanelTitle") == title
            assert (config.pop("sidebarDimension", None) is not None) == (kind == "Plot")
            yield LEGACY_NAME.get(kind, kind), title, config
        else:
            assert set(node) == {"first", "second", "direction", "splitPercentage"} and 0 < node["splitPercentage"] < 100
            yield from walk(node["first"])
            yield from walk(node["second"])

    found = list(walk(layout["layout"]))
    assert not panels, f"panels that stand nowhere: {list(panels)}"
    return found


def main(out):
    messages, schemas, attached, texts, times = read(out / "run.mcap")
    frames = {n for m in messages["/armcal/tf"] for t in m.transforms for n in (t.parent_frame_id, t.child_frame_id)}
    resolver, panels = Resolver(messages, texts, times), {}
    for name, walk in [("foxglove-layout.json", current), ("foxglove-layout-legacy.json", legacy)]:
        text = (out / name).read_bytes()
        assert attached[f"armcal/{name}"] == text, f"{name} is not what is attached"
        panels[name] = walk(json.loads(text))
        for kind, title, config in panels[name]:
            try:
                resolver.panel(kind, config, schemas, frames)
            except AssertionError as e:
                raise AssertionError(f"{name}, {title}: {e}") from e
    # What has a curve is among what was found.
    found = [row.effect for m in messages["/armcal/effect_table"] for row in m.found]
    assert found.count("not listed") == sum(t.startswith("/armcal/unlisted/") for t in messages), found
    new, old = panels.values()
    assert new == old, "the two formats show different things"
    size = {t: len(m) for t, m in messages.items()}
    print(json.dumps({"panels": Counter(k for k, _, _ in new), "paths": len(resolver.used), "messages": sum(size.values()),
                      "titles": [t for _, t, _ in new]}))


main(Path(sys.argv[1]))
