"""An S3-compatible server (moto) on a free port of 127.0.0.1, with one bucket filled from a folder.

usage: s3_server.py BUCKET FOLDER LOG

Prints the port, serves until stdin ends, and appends a JSON line to LOG for every request answered. Where moto
does not behave as the real service can, this does: bucket `denied` refuses, bucket `elsewhere` is in another region, and for
every key that begins with `flaky` the server is busy the first time; one that begins with `replaced` is replaced after the
first time.
"""
import json
import sys
import threading
from pathlib import Path

import boto3
from moto.server import DomainDispatcherApplication, create_backend_app
from werkzeug.serving import WSGIRequestHandler, make_server

bucket, folder, log_path = sys.argv[1:]
moto = DomainDispatcherApplication(create_backend_app)
log = open(log_path, "a", buffering=1)
lock, asked = threading.Lock(), set()


def error(start, status, code, message):
    body = f"<?xml version='1.0'?><Error><Code>{code}</Code><Message>{message}</Message></Error>".encode()
    start(status, [("Content-Type", "application/xml"), ("Content-Length", str(len(body)))])
    return [body]


def answer(environ, start):
    path = environ["PATH_INFO"]
    if path.startswith("/denied/"):
        return error(start, "403 Forbidden", "AccessDenied", "Access Denied")
    if path.startswith("/elsewhere/"):
        return error(start, "301 Moved Permanently", "PermanentRedirect", "use another endpoint")
    if path.startswith(f"/{bucket}/flaky") and environ["REQUEST_METHOD"] == "GET":
        with lock:
            first = path not in asked
            asked.add(path)
        if first:
            return error(start, "503 Slow Down", "SlowDown", "Please reduce your request rate.")
    return moto(environ, start)


def logged(environ, start):
    said = {}

    def note(status, headers, *rest):
        said["status"] = int(status.split()[0])
        return start(status, headers, *rest)

    body = b"".join(answer(environ, note))
    path = environ["PATH_INFO"]
    if path.startswith(f"/{bucket}/replaced") and environ["REQUEST_METHOD"] == "GET" and path not in asked:
        asked.add(path)
        s3.put_object(Bucket=bucket, Key=path.removeprefix(f"/{bucket}/"), Body=b"another" * 1000)
    entry = {"method": environ["REQUEST_METHOD"], "path": environ["PATH_INFO"], "bytes": len(body)}
    entry |= {"status": said["status"], "range": environ.get("HTTP_RANGE", "")}
    with lock:
        log.write(json.dumps(entry) + "\n")
    return [body]


class Silent(WSGIRequestHandler):
    protocol_version = "HTTP/1.1"

    def log(self, *_):
        pass


server = make_server("127.0.0.1", 0, logged, threaded=True, request_handler=Silent)
threading.Thread(target=server.serve_forever, daemon=True).start()
endpoint = f"http://127.0.0.1:{server.port}"
s3 = boto3.client("s3", endpoint_url=endpoint, region_name="us-east-1", aws_access_key_id="k", aws_secret_access_key="s")
s3.create_bucket(Bucket=bucket)
for path in sorted(p for p in Path(folder).rglob("*") if p.is_file()):
    s3.put_object(Bucket=bucket, Key=str(path.relative_to(folder)), Body=path.read_bytes())
print(server.port, flush=True)
sys.stdin.read()
