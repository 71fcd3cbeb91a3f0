"""Columns out of decoded messages, the same for every Python reader: what armcal reads into `Samples`."""
import hashlib

import numpy as np

JOINTS, TIP = "/joint_states", "/vicon/tip/tip"


class Columns:
    def __init__(self):
        self.joint_ns, self.position, self.effort = [], [], []
        self.tip_ns, self.tip_m, self.quaternion_xyzw = [], [], []

    def add(self, topic, message):
        stamp = message.header.stamp
        time_ns = stamp.sec * 1_000_000_000 + stamp.nanosec
        if topic == JOINTS:
            self.joint_ns.append(time_ns)
            self.position.append(message.position)
            self.effort.append(message.effort)
        else:
            at, turn = message.pose.position, message.pose.orientation
            self.tip_ns.append(time_ns)
            self.tip_m.append((at.x, at.y, at.z))
            self.quaternion_xyzw.append((turn.x, turn.y, turn.z, turn.w))

    def finish(self):
        """Lists to arrays; part of the time that is measured."""
        self.joint_ns, self.tip_ns = (np.array(t, dtype=np.int64) for t in (self.joint_ns, self.tip_ns))
        self.position, self.effort = (np.array(v, dtype=float).T.copy() for v in (self.position, self.effort))
        self.tip_m, self.quaternion_xyzw = (np.array(v, dtype=float) for v in (self.tip_m, self.quaternion_xyzw))

    def facts(self):
        """Rows, and a hash of every bit of the columns that no reader computes with."""
        digest = hashlib.sha256()
        for column in (self.joint_ns, self.position, self.effort, self.tip_ns, self.tip_m):
            digest.update(column.tobytes())
        return {
            "joint_rows": len(self.joint_ns),
            "tip_rows": len(self.tip_ns),
            "sha256": digest.hexdigest(),
            "quaternion_sum": float(np.sum(self.quaternion_xyzw)),
        }
