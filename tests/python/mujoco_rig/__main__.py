"""usage: python -m mujoco_rig MECHANISM SEED FOLDER -> a session in FOLDER, its truth in FOLDER-truth.json"""
import json
import sys

import numpy as np

from .hidden import MECHANISMS
from .machine import as_built
from .recorder import write
from .session import Session


def make(mechanism, seed, folder):
    """One session; all that is random comes from the seed."""
    draw = np.random.default_rng([seed, list(MECHANISMS).index(mechanism)])
    hidden = MECHANISMS[mechanism](draw)
    write(folder, Session(as_built(draw), hidden, draw).run(), draw)
    truth = {"mechanism": hidden.name, "accept": hidden.accept, "size": hidden.size, "unit": hidden.unit, "seed": seed}
    with open(f"{folder}-truth.json", "w") as out:
        json.dump(truth, out)
    return truth


if __name__ == "__main__":
    print(json.dumps(make(sys.argv[1], int(sys.argv[2]), sys.argv[3])))
