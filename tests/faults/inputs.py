"""Hostile input to the whole program: devices, pipes and links where files belong, places that cannot be written, YAML that explodes, numbers without measure.

Each is refused with exit 2 and words within a bounded time and memory, or taken for what it says; nothing is written by a refused run.
"""
import os
import resource

from common import Wrong, command, fresh, lay_out, one, results, run, same
from scenes import BREAKING, FEM, FLOOR, TOOLS

NOBODY = 65534
SECONDS, MEMORY = 120, 6 << 30

PLATE_GEO = """\
Point(1) = {0, 0, 0, 4}; Point(2) = {40, 0, 0, 4}; Point(3) = {40, 20, 0, 4}; Point(4) = {0, 20, 0, 4};
Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 1};
Curve Loop(1) = {1, 2, 3, 4}; Plane Surface(1) = {1};
Physical Surface("plate") = {1};
Physical Curve("xmin") = {4};
Physical Curve("xmax") = {2};
"""
MESHED = FEM.replace("geometry: {box: {size: [40 mm, 10 mm]}}", "geometry: plate.geo\n    length_unit: 1 mm").replace("end: 400 us", "end: 40 us")
PACKED = BREAKING.replace("{radius: 0.9 mm, spread: 0.2, seed: 1}", "{file: grains.csv}").replace("end: 300 us", "end: 15 us")
GRAINS = "".join("%g %g 0 0.001\n" % (0.001 + 0.002 * i, 0.001 + 0.002 * j) for i in range(20) for j in range(10))


def limits(user):
    def before():
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
        if user:
            os.setgid(NOBODY)
            os.setuid(NOBODY)
    return None if "ASAN_OPTIONS" in os.environ and not user else before


def refused(cleave, here, what, *more, words=(), code=2, user=False, output="out"):
    before = sorted(os.listdir(here))
    try:
        got, said = run(command(cleave, output, *more), here, timeout=SECONDS, before=limits(user))
    except Exception as trouble:  # TimeoutExpired
        raise Wrong("%s: %s" % (what, trouble))
    if got != code or not all(word in said for word in words) or "PETSC ERROR" in said or "Traceback" in said or not said.strip():
        raise Wrong("%s: exit %d, which should be %d, with the words %s: %s" % (what, got, code, words, said[-1500:]))
    if sorted(os.listdir(here)) != before:
        raise Wrong("%s: something was written: %s" % (what, sorted(set(os.listdir(here)) - set(before))))


def fits(cleave, here, what, whole, *more, output="out", scene=None):
    words = command(cleave, output, *more)
    if scene:
        words[2] = scene
    code, said = run(words, here, timeout=SECONDS)
    if code:
        raise Wrong("%s: exit %d: %s" % (what, code, said))
    other = [name for name in same(whole, results(os.path.join(here, output))) if name not in ("checkpoint.h5/run/scene", "checkpoint.h5/run/stamp")]  # the scene's text
    if other:
        raise Wrong("%s gives another result: %s" % (what, other[:5]))


def odd_files(here, name):
    """(what, what to do to have it there) of all that a name may stand for and that is no file."""
    path = os.path.join(here, name)
    yield "nothing", lambda: None, "no file"
    yield "a directory", lambda: os.mkdir(path), "is a directory"
    yield "a pipe", lambda: os.mkfifo(path), "a device or a pipe"
    yield "/dev/zero", lambda: os.symlink("/dev/zero", path), "a device or a pipe"
    yield "a link to itself", lambda: os.symlink(name, path), "link"
    yield "a link to nothing", lambda: os.symlink("nowhere", path), "no file"
    yield "an empty file", lambda: open(path, "w").close(), ""
    yield "a megabyte of zeros", lambda: open(path, "wb").write(bytes(1 << 20)), ""


def files(cleave, folder):
    """Mesh, packing, tool and scene: what is no file is refused by its name; links, .. and absolute paths to one are taken."""
    count = 0
    for kind, scene, name, data in (("mesh", one(MESHED, "", plate_geo=PLATE_GEO), "plate.geo", PLATE_GEO), ("mesh", one(MESHED.replace("plate.geo", "plate.msh").replace("    mesh: {size: 2 mm, cells: quad}\n", ""), ""), "plate.msh", None),
                                    ("packing", one(PACKED, "", grains_csv=GRAINS), "grains.csv", GRAINS), ("tool", one(TOOLS.replace("end: 20 ms", "end: 0.2 ms"), "", floor_stl=FLOOR), "floor.stl", FLOOR)):
        here = lay_out(fresh(os.path.join(folder, kind + "-" + name)), scene)
        path = os.path.join(here, name)
        if data:
            code, said = run(command(cleave, "whole"), here)
            if code:
                raise Wrong("%s: %s" % (kind, said))
            whole = results(os.path.join(here, "whole"))
            os.rename(path, os.path.join(folder, name))
            text = scene["files"]["scene.yaml"]
            for what, other in (("an absolute path", os.path.join(os.path.realpath(folder), name)), ("a path with ..", "../" + name), ("a path through itself", "./../%s/../%s" % (os.path.basename(here), name))):
                with open(os.path.join(here, "scene.yaml"), "w") as out:
                    out.write(text.replace(name, other))
                fits(cleave, here, "%s: %s" % (kind, what), whole)
                count += 1
            with open(os.path.join(here, "scene.yaml"), "w") as out:
                out.write(text)
            os.symlink("../" + name, path)
            fits(cleave, here, kind + ": a link", whole)
            os.remove(path)
            fresh(os.path.join(here, "out"))
            count += 1
        for what, make, words in odd_files(here, name):
            make()
            if words == "no file" and kind == "tool":
                words = "is not there"
            refused(cleave, here, "%s: %s" % (kind, what), words=("scene.yaml:", name, words))
            if os.path.isdir(path) and not os.path.islink(path):
                os.rmdir(path)
            elif os.path.lexists(path):
                os.remove(path)
            count += 1
    here = fresh(os.path.join(folder, "scene"))
    os.makedirs(here)
    for what, make, words in odd_files(here, "scene.yaml"):
        make()
        refused(cleave, here, "scene: " + what, words=("scene.yaml", words.replace("no file", "no such file").replace("a device or a pipe", "regular file").replace("link", "no such file")))
        path = os.path.join(here, "scene.yaml")
        if os.path.isdir(path) and not os.path.islink(path):
            os.rmdir(path)
        elif os.path.lexists(path):
            os.remove(path)
        count += 1
    return count


def places(cleave, folder):
    """Where results cannot go, and roundabout ways to where they can."""
    here = lay_out(fresh(os.path.join(folder, "places")), one(FEM.replace("end: 400 us", "end: 20 us"), ""))
    code, said = run(command(cleave, "whole"), here)
    if code:
        raise Wrong(said)
    whole = results(os.path.join(here, "whole"))
    open(os.path.join(here, "file"), "w").close()
    os.mkfifo(os.path.join(here, "pipe"))
    os.symlink("loop", os.path.join(here, "loop"))
    os.symlink("nowhere/at/all", os.path.join(here, "dangling"))
    os.makedirs(os.path.join(here, "real"))
    os.symlink("real", os.path.join(here, "link"))
    bad = ["file", "file/below", "pipe", "/dev/null", "/dev/null/below", "loop", "loop/below", "dangling", "a" * 300, "/".join(["deep"] * 2000), "/proc/self", "", "/proc/nothing"]
    for output in bad:
        refused(cleave, here, "output in %.40r" % output, output=output)
    for what, output in (("a link to a directory", "link"), ("a path with ..", "real/../two"), ("an absolute path", os.path.join(os.path.realpath(here), "three")), ("a name with blanks, quotes and %s", "a 'b' \"c\" %s %n"), ("a name in other letters", "Ergebniß-結果")):
        fits(cleave, here, "output: " + what, whole, output=output)
    # links in the result directory's own names are replaced, not written through
    victim = os.path.join(here, "victim")
    for name in ("history.csv", "checkpoint.h5", "fields.h5", "summary.json", "resolved.yaml", "checkpoint.h5.part", "history.csv.part", "fields.h5.part", "summary.json.part", "resolved.yaml.part"):
        output = fresh(os.path.join(here, "linked"))
        os.makedirs(output)
        with open(victim, "w") as out:
            out.write("mine")
        os.symlink(victim, os.path.join(output, name))
        fits(cleave, here, "a link named " + name, whole, output="linked")
        if open(victim).read() != "mine":
            raise Wrong("a run wrote through a link named %s" % name)
    count = len(bad) + 5 + 10
    if os.getuid() == 0:  # as somebody who may not
        closed = os.path.join(here, "closed")
        os.makedirs(closed, mode=0o755)
        for place in (folder, here):
            os.chmod(place, 0o755)
        at, chain = os.path.abspath(here), []
        while at != "/":
            chain.append(os.stat(at).st_mode & 0o005 == 0o005)
            at = os.path.dirname(at)
        if all(chain) and os.access(cleave, os.X_OK):
            refused(cleave, here, "a directory of somebody else's", words=("not writable",), user=True, output="closed")
            refused(cleave, here, "a directory in somebody else's", words=("Cannot create",), user=True, output="closed/below")
            secret = os.path.join(here, "scene.yaml")
            os.chmod(secret, 0o600)
            refused(cleave, here, "a scene of somebody else's", words=("scene.yaml", "cannot be read"), user=True)
            os.chmod(secret, 0o644)
            count += 3
    return count


def bomb(levels):
    return "a0: &a0 [x, x]\n" + "".join("a%d: &a%d [%s]\n" % (k, k, ", ".join(["*a%d" % (k - 1)] * 9)) for k in range(1, levels))


def texts(cleave, folder):
    """YAML that explodes, nests, repeats or is none, and numbers without measure."""
    here = lay_out(fresh(os.path.join(folder, "texts")), one(FEM, ""))
    cases = {
        "aliases that explode": bomb(12),
        "aliases that explode behind a scene": FEM + bomb(12),
        "an alias to itself": "a: &a [*a]\n",
        "a merge key": "base: &b {x: 1}\nother: {<<: *b}\n",
        "lists in lists, 100,000 deep": "a: " + "[" * 100000 + "]" * 100000 + "\n",
        "lists in lists, never closed": "a: " + "[" * 100000,
        "maps in maps, 20,000 deep": "{a: " * 20000 + "1" + "}" * 20000,
        "indented 3,000 deep": "".join(" " * k + "a:\n" for k in range(3000)),
        "two documents": FEM + "---\n" + FEM,
        "a tag": FEM.replace("fix: all", "fix: !!python/object all"),
        "a key 1 MB long": "a" * (1 << 20) + ": 1\n",
        "a value 1 MB long": FEM.replace("a small beam", "x" * (1 << 20)),
        "5 MB": FEM + "# " + "x" * (5 << 20) + "\n",
        "300,000 keys": FEM + "".join("k%d: 1\n" % k for k in range(300000)),
        "zeros": "\0" * 1000,
        "bytes that are no UTF-8": b"title: \xff\xfe\xfd\n" + FEM.encode(),
        "UTF-16": FEM.encode("utf-16"),
        "only a comment": "# nothing\n",
        "a key twice": FEM + FEM,
    }
    numbers = (("210 GPa", "nan Pa"), ("210 GPa", "inf Pa"), ("210 GPa", "-1 Pa"), ("210 GPa", "1e999 Pa"), ("210 GPa", "1e-999 Pa"), ("210 GPa", "0x10 Pa"), ("poisson: 0.3", "poisson: 1e308"), ("size: 2 mm", "size: 1e-300 mm"),
               ("size: 2 mm", "size: 1 nm"), ("size: 2 mm", "size: -2 mm"), ("end: 400 us", "end: 1e300 s, step: 1e-300 s"), ("end: 400 us", "end: 400 us, step: 0 s"), ("every: 5 us", "every: -5 us"),
               ("size: [40 mm, 10 mm]", "size: [40 mm]"), ("size: [40 mm, 10 mm]", "size: [1e300 m, 1e300 m]"), ("size: [40 mm, 10 mm]", "size: [1e-300 m, 1e-300 m]"), ("size: [40 mm, 10 mm]", "size: [0 mm, 10 mm]"),
               ("thickness: 10 mm", "thickness: 0 mm"), ("dimension: 2", "dimension: 9223372036854775807"), ("dimension: 2", "dimension: 99999999999999999999"), ("  beam:", "  ../beam:"), ("  beam:", "  \"\":"))
    for old, new in numbers:
        if old not in FEM:
            raise Wrong("the case replaces nothing: " + old)
        cases["%s instead of %s" % (new, old)] = FEM.replace(old, new)
    particles = (("radius: 0.9 mm", "radius: 1 nm"), ("radius: 0.9 mm", "radius: 1 km"), ("radius: 0.9 mm", "count: 1e30"), ("spread: 0.2", "spread: 1e9"), ("seed: 1", "seed: -1"))
    for old, new in particles:
        cases["%s instead of %s" % (new, old)] = BREAKING.replace(old, new)
    for what, text in cases.items():
        with open(os.path.join(here, "scene.yaml"), "wb") as out:
            out.write(text if isinstance(text, bytes) else text.encode())
        refused(cleave, here, what, words=("scene.yaml",))
    with open(os.path.join(here, "scene.yaml"), "w") as out:
        out.write(BREAKING.replace("radius: 0.9 mm", "count: 100000000"))
    if "ASAN_OPTIONS" not in os.environ:
        refused(cleave, here, "more particles than there is memory", words=("No memory",), code=1)
    return len(cases) + 1


def meshes(cleave, folder):
    """Meshes and packings that are files, and wrong: nodes and particles in one place."""
    here = lay_out(fresh(os.path.join(folder, "meshes")), one(MESHED.replace("plate.geo", "plate.msh").replace("    mesh: {size: 2 mm, cells: quad}\n", ""), ""))

    def msh(nodes, quads):
        """Gmsh 2.2: nodes [(x, y)], quads [(a, b, c, d)] from 1; lines 1-4 and 2-3 of the first and last quad are xmin and xmax."""
        lines = [(1, quads[0][0], quads[0][3]), (2, quads[-1][1], quads[-1][2])]
        cells = ["%d 1 2 %d %d %d %d" % (k + 1, line[0], line[0], line[1], line[2]) for k, line in enumerate(lines)] + ["%d 3 2 3 3 %d %d %d %d" % ((k + 3,) + quad) for k, quad in enumerate(quads)]
        return ("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n3\n1 1 \"xmin\"\n1 2 \"xmax\"\n2 3 \"plate\"\n$EndPhysicalNames\n$Nodes\n%d\n" % len(nodes)
                + "".join("%d %g %g 0\n" % (k + 1, x, y) for k, (x, y) in enumerate(nodes)) + "$EndNodes\n$Elements\n%d\n" % len(cells) + "\n".join(cells) + "\n$EndElements\n")

    good = [(0, 0), (10, 0), (20, 0), (0, 10), (10, 10), (20, 10)]
    cells = [(1, 2, 5, 4), (2, 3, 6, 5)]
    slit = good + [(10, 0), (10, 10)]
    cases = (("two quadrilaterals", good, cells, None), ("their common nodes doubled: two bodies, one of them loose", slit, [(1, 2, 5, 4), (7, 3, 6, 8)], None), ("two nodes of one element in one place", [(0, 0), (10, 0), (20, 0), (0, 10), (10, 0), (20, 10)], cells, "two of its n"),
             ("an element twice", good, cells[:1] + cells, "have the same nodes"), ("an element turned inside out", good, [(1, 4, 5, 2), (2, 3, 6, 5)], None), ("a node that is used twice by one element", good, [(1, 2, 2, 4), (2, 3, 6, 5)], ""), ("an element without volume", [(0, 0), (10, 0), (20, 0), (0, 0), (10, 0), (20, 10)], cells, ""))
    for what, nodes, quads, words in cases:
        with open(os.path.join(here, "plate.msh"), "w") as out:
            out.write(msh(nodes, quads))
        if words is None:
            code, said = run(command(cleave, "out"), here, timeout=SECONDS)
            if code not in (0, 2):
                raise Wrong("%s: exit %d %s" % (what, code, said))
            fresh(os.path.join(here, "out"))
        else:
            refused(cleave, here, what, words=("plate.msh", words))
    here = lay_out(fresh(os.path.join(folder, "packings")), one(PACKED, ""))
    packings = (("a particle twice", GRAINS + "0.011 0.011 0 0.001\n", "same centre"), ("a particle all but twice", GRAINS + "0.011000000001 0.011 0 0.001\n", "same centre"), ("a particle hidden in another", GRAINS + "0.0112 0.011 0 0.0001\n", "has no cell"),
                ("a particle outside", GRAINS + "0.05 0.011 0 0.001\n", "outside the body"))
    for what, text, words in packings:
        with open(os.path.join(here, "grains.csv"), "w") as out:
            out.write(text)
        refused(cleave, here, what, words=(words,))
    return len(cases) + len(packings)


PARTS = (("devices, pipes, links and directories in place of files; paths round about", files), ("places for results that cannot be written, and links in them", places), ("YAML that explodes, nests or is none; numbers without measure", texts),
         ("meshes and packings with nodes, elements or particles in one place", meshes))


def inputs(cleave, folder, done=(), keep=None):
    rows = []
    for what, part in PARTS:
        if what in done:
            continue
        rows.append([what, part(cleave, folder), 0])
        print(*rows[-1], sep="  ", flush=True)
        if keep:
            keep(rows[-1])
    return rows
