#!/usr/bin/env python3
"""json_schema_test.py BIN_DIR SOURCE_DIR [live]: the output of --json of every command against its
schema in docs/reference/json. With "live" the commands that need a bus, else all others.

Each document must be valid. It must become invalid when a required key is removed or an unknown
one is added: a renamed key fails. Every command with --json must have a schema and run here."""

import copy
import glob
import json
import math
import os
import re
import subprocess
import sys
import tempfile
import time

try:
    import jsonschema
except ImportError:
    print("SKIPPED, NOT TESTED: the schemas of --json: python3-jsonschema is missing "
          "(tools/setup --all)", file=sys.stderr)
    sys.exit(77)

BIN, SOURCE = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
LIVE = sys.argv[3:] == ["live"]
RCS = BIN + "/rcs"
SCHEMAS = SOURCE + "/docs/reference/json/"
CONFIG = SOURCE + "/config/demo3.toml"
SCENARIO = SOURCE + "/config/sim/drill.toml"
# Commands whose documents are tested with "live".
LIVE_COMMANDS = {"budget", "go", "mission", "play", "predict", "record", "top"}
# Commands without --json, and why.
NO_JSON = {"view": "a server; its JSON is at /api", "log csv": "CSV", "load": "no result", "map export": "writes files only",
           "reference pages": "the same", "reference man": "the same",
           "reference completion": "the same"}

failures = []
tested = set()


def schema_file(command):
    """The schemas of `rcs map ...` are in a folder."""
    name = command.replace(" ", ".")
    return SCHEMAS + re.sub(r"^map\.", "map/", name) + ".schema.json"


def fail(text):
    failures.append(text)
    print("FAILED: " + text, file=sys.stderr)


def rcs(arguments, statuses=(0,)):
    """Runs a command in the folder of the inputs. @return its standard output"""
    done = subprocess.run([RCS] + arguments, capture_output=True, text=True, check=False)
    if done.returncode not in statuses:
        fail(f"rcs {' '.join(arguments)}: status {done.returncode}\n{done.stderr}")
    return done.stdout


def resolved(schema, whole, document):
    """Without references, and of alternatives the one that holds."""
    while "$ref" in schema or "oneOf" in schema:
        if "$ref" in schema:
            schema = whole["$defs"][schema["$ref"].split("/")[-1]]
        else:
            schema = next((one for one in schema["oneOf"] if jsonschema.Draft202012Validator(
                {**one, "$defs": whole.get("$defs", {})}).is_valid(document)), {})
    return schema


def required_keys(document, schema, whole, path=()):
    """Paths of the keys in the document that the schema requires."""
    schema = resolved(schema, whole, document)
    if isinstance(document, dict):
        for key in schema.get("required", []):
            yield path + (key,)
        for key, value in document.items():
            below = schema.get("properties", {}).get(key, schema.get("additionalProperties"))
            if isinstance(below, dict):
                yield from required_keys(value, below, whole, path + (key,))
    elif isinstance(document, list) and document and isinstance(schema.get("items"), dict):
        yield from required_keys(document[0], schema["items"], whole, path + (0,))


def without(document, path):
    changed = copy.deepcopy(document)
    place = changed
    for key in path[:-1]:
        place = place[key]
    place["renamed_" + path[-1]] = place.pop(path[-1])
    return changed


def check(command, text):
    """@return the document"""
    try:
        document = json.loads(text)
    except ValueError as error:
        fail(f"rcs {command}: not JSON: {error}: {text[:200]}")
        return {}
    name = "rcs." + command.replace(" ", ".")
    with open(schema_file(command), encoding="utf-8") as file:
        schema = json.load(file)
    version = schema["properties"]["schema"]["const"]
    if not re.fullmatch(re.escape(name) + "/[1-9]", version):
        fail(f"rcs {command}: the schema is not \"{name}/VERSION\"")
    if list(document)[:1] != ["schema"] or document["schema"] != version:
        fail(f"rcs {command}: the first key is not \"schema\": \"{version}\"")
        return document
    jsonschema.Draft202012Validator.check_schema(schema)
    validator = jsonschema.Draft202012Validator(schema)
    for error in validator.iter_errors(document):
        fail(f"rcs {command}: {'/'.join(map(str, error.absolute_path))}: {error.message[:300]}")
    paths = list(required_keys(document, schema, schema))
    for path in paths[:200]:
        if validator.is_valid(without(document, path)):
            fail(f"rcs {command}: {'/'.join(map(str, path))} may be renamed unnoticed")
    if validator.is_valid({**document, "unknown": 1}):
        fail(f"rcs {command}: an unknown key is not noticed")
    for number in re.findall(r"\d+\.\d+", text):
        if len(number.replace(".", "").strip("0")) > 13:
            fail(f"rcs {command}: noise in a number: {number}")
            break
    tested.add(command)
    print(f"rcs {command}: {len(paths)} required keys")
    return document


def run(command, arguments, statuses=(0,)):
    """@param arguments  in front of --json; without the command if they begin with an option"""
    return check(command, rcs(command.split() + arguments + ["--json"], statuses))


def commands_of_help(words=()):
    """The commands without sub-commands, from --help: name and whether it has --json."""
    text = rcs(list(words) + ["--help"])
    below = re.search(r"^Commands:", text, re.MULTILINE)
    if not below:
        yield " ".join(words), "--json" in text
        return
    for line in text[below.end():].splitlines():
        found = re.match(r"  ([a-z][a-z0-9-]*)(\s{2,}|$)", line)
        if found:
            yield from commands_of_help(words + (found.group(1),))


def check_completeness():
    found = dict(commands_of_help())
    if len(found) < 40:
        fail(f"only {len(found)} commands found in --help")
    for command, has_json in found.items():
        if has_json == (command in NO_JSON):
            fail(f"rcs {command}: --json expected: {command not in NO_JSON}")
        if has_json and command not in LIVE_COMMANDS and command not in tested:
            fail(f"rcs {command}: --json is not tested")
    files = glob.glob(SCHEMAS + "**/*.schema.json", recursive=True)
    schemas = {re.sub(r"[./]", " ", f[len(SCHEMAS):-len(".schema.json")]) for f in files}
    expected = tested | LIVE_COMMANDS
    if schemas != expected:
        fail(f"schemas without a test or tests without a schema: {sorted(schemas ^ expected)}")


def write(name, text):
    with open(name, "w", encoding="utf-8") as file:
        file.write(text)
    return name


def offline():
    sim = run("sim", [SCENARIO, "--duration", "12", "-o", "drive.log", "--prior-map", "map"])
    if sim.get("events", 0) < 1000:
        fail("rcs sim: too few events")
    run("replay", [CONFIG, "drive.log", "-o", "run.log"])
    run("replay", [CONFIG, "drive.log", "-o", "ins.log", "--without", "LADAR_RANGES"])
    run("log info", ["drive.log"])
    run("log list", ["drive.log"])
    run("log cut", ["drive.log", "--to", "3", "-o", "cut.log"])
    run("log cut", ["run.log", "--around", "mode", "-o", "cut.log"])
    run("log cut", ["run.log", "--around", "solution.lost", "-o", "lost.log"], statuses=(1,))
    run("replay", [CONFIG, "drive.log", "--to", "2", "-o", "/dev/null"])
    run("log mcap", ["run.log", "-o", "none.mcap", "--channel", "NOPE"], statuses=(1,))
    run("log mcap", ["run.log", "-o", "run.mcap", "--config", CONFIG])
    run("import mcap", ["run.mcap", "-o", "again.log"])
    run("eval", ["run.log"])
    run("report", ["run.log", "ins.log", "-o", "report.html", "--gps-cut", "8,11"])
    run("log cut", ["drive.log", "--sensors", "-o", "sensors.log"])
    run("replay", [CONFIG, "sensors.log", "-o", "bare.log"])
    run("report", ["bare.log", "-o", "report.html", "--gps-cut", "8,11"])  # without a truth
    run("smooth", ["drive.log", "--config", CONFIG, "--rounds", "1", "-o", "truth.tum"])
    with open("truth.tum.json", encoding="utf-8") as file:
        check("smooth", file.read())
    run("why", ["run.log", "10"])
    check("why route", rcs(["why", "run.log", "route", "--json"]))

    data = os.environ.get("RCS_DATA_DIR", "")
    imports = [
        ("import imu-gps", data + "/gps_imu_husky",
         lambda d: [d + "/test1_imu.csv", d + "/test1_fix.csv", d + "/test1_odom.csv", "--columns",
                    SOURCE + "/config/import/husky.toml", "-o", "husky.log"]),
        ("import comma2k19", data + "/gps_imu_comma2k19", lambda d: [d, "-o", "comma.log"]),
        ("import kitti", data + "/kitti_2011_09_26_drive_0005", kitti),
        ("map import av2", data + "/av2_pittsburgh/7fab2350-7eaf-3b7e-a39d-6937a4c1bede", lambda d: [d, "--sigma", "0.05", "-o", "street"]),
    ]
    for command, folder, arguments in imports:
        if os.path.isdir(folder):
            run(command, arguments(folder))
        else:
            print(f"SKIPPED, NOT TESTED: rcs {command}: no {folder}", file=sys.stderr)
            tested.add(command)

    run("map info", ["map", "--check"])
    run("map localizability", ["map", "--step", "20"])
    run("map build", ["run.log", "--truth", "-o", "built"])
    run("map merge", ["map", "built", "-o", "merged"], (0, 3))
    run("map diff", ["map", "map"])
    write("grid.asc", "ncols 20\nnrows 20\nxllcorner 500000\nyllcorner 5200000\ncellsize 1\n" +
          "\n".join(" ".join(str(300 + 0.1 * c) for c in range(20)) for _ in range(20)) + "\n")
    run("map import raster", ["grid.asc", "--crs", "EPSG:32632", "--heights", "ellipsoid",
                              "--sigma", "0.1", "-o", "raster"])
    write("hill.xyz", "".join(f"{500000 + 0.5 * (k % 60)} {5200000 + 0.5 * (k // 60)} "
                              f"{300 + 0.02 * (k % 60)} 2\n" for k in range(3600)))
    run("map import cloud", ["hill.xyz", "--crs", "EPSG:32632", "--heights", "ellipsoid", "--sigma",
                             "0.1", "--class-column", "4", "-o", "cloud"])
    run("map locate", ["map", "run.log", "--near", "0,0", "--within", "20", "--heading", "90",
                       "--for", "2"], (0, 1))
    write("hills.asc", "ncols 160\nnrows 160\nxllcorner 500000\nyllcorner 5200000\ncellsize 1\n" +
          "\n".join(" ".join(f"{hills(c - 79.5, 79.5 - r):.3f}" for c in range(160))
                    for r in range(160)) + "\n")
    rcs(["map", "import", "raster", "hills.asc", "--crs", "EPSG:32632", "--heights", "ellipsoid",
         "--sigma", "0.1", "-o", "hills"])
    write("scan.xyz", "".join(f"{x} {y} {hills(x, y) - hills(0, 0) - 1:.3f}\n"
                              for x in range(-40, 41) for y in range(-40, 41)))
    pose = f"0 0 {hills(0, 0) - hills_datum() + 1} 0 0 0 1"
    found = run("map match", ["hills", "scan.xyz", "--pose", pose, "--starts", "5"], (0, 1))
    if found.get("converged", 0) == 0:
        fail(f"rcs map match: no start converged: {json.dumps(found)}")
    run("map study", [SCENARIO, "--cell", "5", "--seeds", "1", "--length", "20", "--gps-lost-at",
                      "12", "--config", CONFIG])

    write("lost.toml", 'name = "GPS lost"\n[run]\nlength_s = 14\n[[stimulus]]\nkind = "dropout"\nsource = "gps"\n'
          "begin_s = 9\nlength_s = 3\n[limits]\nhorizontal_m = 5\ndrift_pct_p95 = 1\n")
    run("drill", ["lost.toml", "--scenario", SCENARIO, "--config", CONFIG])
    check("drill list", rcs(["drill", "--list", "--folder", SOURCE + "/config/drills", "--json"]))
    run("outages", ["drive.log", "--config", CONFIG, "--length", "2", "--places", "1", "--from",
                    "9", "--without", "odometry"])
    write("short.toml", f'based_on = "{SCENARIO}"\nduration_s = 46\n')
    run("consistency", ["--scenario", "short.toml", "--ins", "tactical", "--seeds", "1", "--config",
                        CONFIG], (0, 1, 3))
    run("drive", [SOURCE + "/config/sim/hazards.toml", "--duration", "12", "--config", CONFIG], (0, 1))
    run("faults", ["--scenario", "short.toml", "--runs", "1", "--only", "wheels silence", "--config",
                   CONFIG], (0, 1))
    check("faults list", rcs(["faults", "--list", "--json"]))
    cloud = "".join(f"{0.3 * (k % 60) - 9:.3f} {0.3 * (k // 60) - 9:.3f} "
                    f"{0.4 * ((k * 7919) % 11) * (k % 13 == 0):.3f}\n" for k in range(3600))
    write("a.xyz", cloud)
    for method in ("plane", "paper", "gicp"):
        run("register", ["a.xyz", "a.xyz", "--method", method], (0, 1))
    run("register", ["a.xyz", "a.xyz", "--global"], (0, 1))
    run("table1", ["--pairs", "1", "--seeds", "1", "--scenario",
                   SOURCE + "/config/sim/reference.toml"])

    run("config list", ["sp.icp"])
    run("config explain", ["gate_m"])
    write("bad.toml", "[sp.icp]\ngate_m = -1\n")
    run("config check", [CONFIG, "bad.toml"], (1,))
    run("config show", [CONFIG])
    run("keys", ["keys", "--vehicle", "demo3", "--operator", "alice"])
    run("up", [CONFIG, "--check"])
    check_completeness()


def kitti(folder):
    os.makedirs("sweeps", exist_ok=True)
    subprocess.run(["tar", "-xJf", folder + "/velodyne_bin_000-079.tar.xz", "-C", "sweeps",
                    "--wildcards", "*000000000[0-1].bin"], check=True)
    return ["--scans", "sweeps", "--poses", folder + "/poses/oxts_imu_poses_kitti.txt", "--calib",
            folder + "/calib", "-o", "kitti.log"]


def hills(x, y):
    return (4 * math.sin(0.05 * x + 0.3) * math.cos(0.04 * y) +
            1.5 * math.sin(0.11 * y + 0.06 * x))


def hills_datum():
    """The height of the map's origin: its axes are at the centre of the raster."""
    return json.loads(rcs(["map", "info", "hills", "--json"]))["datum"]["height_m"]


def live():
    rcs(["sim", SCENARIO, "--duration", "16", "-o", "drive.log"])
    check("sim", rcs(["sim", SCENARIO, "--duration", "2", "--json"]))
    up = subprocess.Popen([RCS, "up", CONFIG], stderr=subprocess.PIPE, text=True)
    player = None
    try:
        time.sleep(4)
        player = subprocess.Popen([RCS, "play", "drive.log", "--json"], stdout=subprocess.PIPE,
                                  stderr=subprocess.DEVNULL, text=True)
        time.sleep(12)
        top = run("top", ["--listen", "2"])
        if "nav" not in top or "bg" not in top or len(top["nodes"]) < 3:
            fail(f"rcs top: not all nodes are shown: {json.dumps(top)[:500]}")
        run("predict", ["--to", "20,5", "--timeout", "20"])
        if run("record", ["recording", "--duration", "2", "--reserve-mb", "0"])["messages"] < 100:
            fail("rcs record: too few messages")
        mission = subprocess.Popen([BIN + "/mission", CONFIG],
                                   stderr=subprocess.DEVNULL)
        time.sleep(3)
        run("mission", ["hold"], (0, 1))
        mission.terminate()
        mission.wait()
        run("go", ["--waypoint", "9,0", "--frame", "local", "--timeout", "1"], (0, 1))
        check("play", player.communicate(timeout=60)[0])
    finally:
        up.terminate()
        up.communicate()
        if player:
            player.kill()
    run("budget", [CONFIG, "drive.log", "--seconds", "4"], (0, 1))
    if not LIVE_COMMANDS <= tested:
        fail(f"not tested: {sorted(LIVE_COMMANDS - tested)}")


def main():
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        os.environ["XDG_STATE_HOME"] = folder + "/state"
        os.environ.pop("STATE_DIRECTORY", None)
        live() if LIVE else offline()
        os.chdir("/")
    print(f"{len(tested)} commands, {len(failures)} failures")
    return 1 if failures else 0


sys.exit(main())
