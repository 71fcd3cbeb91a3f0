"""Puts the shared library into the wheel: builds it, or takes the one that ARMCAL_KINEMATICS_LIBRARY names."""

import json
import os
import pathlib
import subprocess
import sysconfig

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class SharedLibrary(BuildHookInterface):
    def initialize(self, version, build_data):
        library = os.environ.get("ARMCAL_KINEMATICS_LIBRARY") or self.built()
        name = pathlib.Path(library).name
        build_data["force_include"][library] = f"armcal_kinematics/{name}"
        build_data["pure_python"] = False
        # Any Python, this platform.
        build_data["tag"] = "py3-none-" + sysconfig.get_platform().replace("-", "_").replace(".", "_")

    def built(self):
        command = ["cargo", "build", "--release", "--locked", "--lib", "--message-format=json-render-diagnostics"]
        lines = subprocess.run(command, cwd=self.root, check=True, stdout=subprocess.PIPE, text=True).stdout.splitlines()
        artifacts = [message for message in map(json.loads, lines) if message.get("target", {}).get("name") == "armcal_kinematics"]
        files = [file for artifact in artifacts for file in artifact.get("filenames", [])]
        return next(file for file in files if file.endswith((".so", ".dylib", ".dll")))
