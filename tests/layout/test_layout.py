#!/usr/bin/env python3
"""test_layout.py [ROOT [DRAWING.dot]]: the tree as CONTRIBUTING.md promises it: no function over 90
lines, no file over 600, no DESIGN.md over 1500 words, includes without circles between files, rooms
and folders, and in the order preprocess, simulate, plan, pipeline. Draws the rooms' includes as a
graph for dot where a file is named. What is known to be too long stands in KNOWN, with its reason."""
import pathlib
import re
import sys
import tempfile

LONGEST_FUNCTION, LONGEST_FILE, MOST_WORDS = 90, 600, 1500
FOLDERS = ["preprocess", "simulate", "plan", "pipeline"]  # each includes those before it
# Too long still: to be split, and never to grow.
KNOWN = {}


def sources(root, *endings):
    for top in FOLDERS + ["tests"]:
        for path in sorted((root / top).rglob("*")):
            if path.suffix in endings and "node_modules" not in path.parts:
                yield path


def without_noise(text):
    """The text with comments, strings and characters blanked, line by line as long as it was."""
    def blank(match):
        return re.sub(r"[^\n]", " ", match.group())
    noise = r'R"(\w*)\((?:.|\n)*?\)\1"|"(?:\\.|[^"\\\n])*"|(?<![\w])\'(?:\\.|[^\'\\\n])+\'|//[^\n]*|/\*(?:.|\n)*?\*/'
    return re.sub(noise, blank, text)


def functions(text):
    """(name, first line, lines) of every body in braces that follows a parameter list and stands in no
    other such body."""
    text = without_noise(text)
    stack, found = [], []
    for match in re.finditer(r"[{}]", text):
        if match.group() == "{":
            head = re.split(r"[;{}]", text[max(0, match.start() - 600):match.start()])[-1]
            head = re.sub(r"^\s*#[^\n]*$", "", head, flags=re.M).strip()
            is_type = re.search(r"\b(class|struct|enum|namespace|union)\b", head) and "(" not in head
            is_body = "(" in head and not is_type and not head.rstrip().endswith("=")
            inside = any(kind for kind, _, _ in stack)
            name = re.findall(r"[\w:~]+(?=\s*\()", head)
            stack.append((is_body and not inside, name[0] if name else head[-40:], match.start()))
        elif stack:
            is_function, name, start = stack.pop()
            if is_function:
                first = text.count("\n", 0, start) + 1
                found.append((name, first, text.count("\n", start, match.start()) + 1))
    return found


def find_cycle(graph):
    """A list of names that include each other in a circle; empty where there is none."""
    state, path = {}, []

    def visit(name):
        state[name] = "open"
        path.append(name)
        for other in sorted(graph.get(name, ())):
            if state.get(other) == "open":
                return path[path.index(other):] + [other]
            if other not in state:
                circle = visit(other)
                if circle:
                    return circle
        state[name] = "done"
        path.pop()
        return []

    for name in sorted(graph):
        if name not in state:
            circle = visit(name)
            if circle:
                return circle
    return []


def includes(root):
    graph = {}
    for path in sources(root, ".h", ".cpp"):
        name = str(path.relative_to(root))
        if name.startswith("tests/"):
            continue
        named = re.findall(r'^#include "([^"]+)"', path.read_text(), flags=re.M)
        graph[name] = {other for other in named if (root / other).is_file()}
    return graph


def room_of(name):
    return str(pathlib.PurePath(name).parent)


def rooms(graph):
    between = {}
    for name, others in graph.items():
        own = between.setdefault(room_of(name), set())
        own.update(room_of(other) for other in others if room_of(other) != room_of(name))
    return between


def problems_of(root):
    problems = []

    def too_long(what, size, most):
        most = KNOWN.get(what, most)
        if size > most:
            problems.append(f"{what}: {size}, expected at most {most}")

    for path in sources(root, ".h", ".cpp", ".js", ".mjs", ".py"):
        text = path.read_text()
        name = str(path.relative_to(root))
        too_long(name, text.count("\n"), LONGEST_FILE)
        if path.suffix in (".h", ".cpp"):
            for function, _, lines in functions(text):
                too_long(f"{name}: {function}", lines, LONGEST_FUNCTION)
    for path in sorted(root.glob("p*/**/DESIGN.md")) + sorted(root.glob("simulate/DESIGN.md")):
        if "node_modules" not in path.parts:
            too_long(str(path.relative_to(root)), len(path.read_text().split()), MOST_WORDS)

    graph = includes(root)
    for what, names in (("files", graph), ("rooms", rooms(graph))):
        circle = find_cycle(names)
        if circle:
            problems.append(f"{what} include each other: {' -> '.join(circle)}")
    for name, others in graph.items():
        for other in others:
            if FOLDERS.index(name.split("/")[0]) < FOLDERS.index(other.split("/")[0]):
                problems.append(f"{name} includes {other}: {' -> '.join(FOLDERS)} is one way")
    return problems


def draw(root, file):
    lines = ["digraph rooms {", "  rankdir=LR; node [shape=box];"]
    for room, others in sorted(rooms(includes(root)).items()):
        lines += [f'  "{room}" -> "{other}";' for other in sorted(others)]
    pathlib.Path(file).write_text("\n".join(lines + ["}", ""]))


def check_itself():
    """Each rule finds what breaks it."""
    body = "  int i = 0;  // }\n"
    assert [(n, k) for n, _, k in functions("int f(int a) {\n" + body * 98 + "}\n")] == [("f", 100)]
    assert [k for _, _, k in functions("struct A {\n" + body * 200 + "  void g() {\n }\n};\n")] == [2]
    assert functions('const char* s = "void f() {";\n') == []
    assert find_cycle({"a": {"b"}, "b": {"c"}, "c": {"a"}}) == ["a", "b", "c", "a"]
    assert find_cycle({"a": {"b", "c"}, "b": {"c"}, "c": set()}) == []
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        for top in FOLDERS + ["tests"]:
            (root / top / "room").mkdir(parents=True)
        (root / "plan/room/a.h").write_text('#include "pipeline/room/b.h"\n')
        (root / "pipeline/room/b.h").write_text('#include "plan/room/a.h"\n' + "\n" * 700)
        (root / "plan/DESIGN.md").write_text("word " * 1501)
        found = "\n".join(problems_of(root))
        for words in ("b.h: 701", "DESIGN.md: 1501", "files include each other",
                      "rooms include each other", "one way"):
            assert words in found, (words, found)


def main():
    root = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ".").resolve()
    check_itself()
    if len(sys.argv) > 2:
        draw(root, sys.argv[2])
    problems = problems_of(root)
    for problem in problems:
        print(problem)
    print(f"{len(problems)} problems" if problems else "layout: ok")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
