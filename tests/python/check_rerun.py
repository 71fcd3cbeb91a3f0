"""What Rerun makes of a run's MCAP without any configuration; prints one JSON line.

usage: check_rerun.py RUN.mcap

Rerun reads the messages it knows as its own archetypes and everything else as raw structs, which it does not draw. So: both
robots and the board as geometry in frames that the transforms move, errors as points, paths as poses, the log as text.
"""
import json
import sys
from collections import defaultdict

from rerun.chunk import McapReader


def components(path):
    """Names of components, and their values, by entity; without times and row numbers."""
    found = defaultdict(lambda: defaultdict(list))
    for chunk in McapReader(path).stream().to_chunks():
        batch = chunk.to_record_batch()
        for name in (n for n in batch.schema.names if ":" in n):
            found[chunk.entity_path][name].extend(batch.column(name).to_pylist())
    return found


def flat(values):
    """The strings of lists in lists."""
    if isinstance(values, str):
        return {values}
    return set().union(*(flat(v) for v in values)) if isinstance(values, list) else set()


def main(path):
    found = components(path)

    def has(entity, component):
        names = [n for n in found.get(entity, {}) if n.split("/")[-1].split("@")[-1].startswith(component)]
        assert names, f"{entity} has no {component}: {sorted(found.get(entity, {}))}"
        return [v for n in names for v in found[entity][n]]

    frames = flat(has("/armcal/tf", "Transform3D:child_frame"))
    # Its views look at this frame unless a blueprint says otherwise: what does not hang on it is not seen.
    assert "tf#/" in flat(has("/armcal/tf", "Transform3D:parent_frame")), "nothing hangs on the root"
    points = has("/armcal/errors", "Points3D:positions")
    for topic in ("path_measured", "path_nominal", "path_calibrated"):
        has(f"/armcal/{topic}", "InstancePoses3D:translations")
    assert any(flat(has("/armcal/log", "TextLog:text"))), "an empty log"
    drawn = {}
    for robot in ("nominal", "calibrated", "board"):
        shapes = [e for e in found if e.startswith(f"/{robot}/visual_geometries/")]
        solid = [e for e in shapes if any(c in n for n in found[e] for c in ("Cylinders3D", "Boxes3D"))]
        assert solid, f"{robot} is not drawn: {sorted(found)}"
        stands = set().union(*(flat(has(e, "CoordinateFrame:frame")) for e in solid))
        drawn[robot] = {"shapes": len(solid), "frames": sorted(stands)}
        assert stands <= frames, f"{robot} stands in {stands - frames}, which nothing moves"
    print(json.dumps({"points": sum(len(p or []) for p in points), "frames": len(frames), "drawn": drawn}))


main(sys.argv[1])
