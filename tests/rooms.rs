//! In: the `use` lines and paths of src/ and program/src/. Out: a failure for files that import each other in a circle,
//! and for rooms with too many files at one level (ARCHITECTURE.md).
//! Frame and unit: none.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Files side by side that a newcomer still takes in.
const MOST_FILES: usize = 15;

type Module = Vec<String>;

/// One `use` or path of a file: the module it is written in, whether it is `pub use`, its names.
struct Import {
    public: bool,
    path: Vec<String>,
    /// The name by which the file knows it.
    name: String,
}

/// What a source says, comments and its own tests left out.
fn code(text: &str) -> String {
    let own = text.split("#[cfg(test)]\nmod ").next().unwrap_or("");
    own.lines().map(|l| l.split("//").next().unwrap_or("")).collect::<Vec<_>>().join("\n")
}

/// The paths of a `use` tree, one a leaf.
fn leaves(tree: &str) -> Vec<String> {
    let Some(open) = tree.find('{') else { return vec![tree.trim().to_owned()] };
    let (head, body) = (tree[..open].trim(), &tree[open + 1..tree.rfind('}').expect("a brace is not closed")]);
    let (mut depth, mut parts) = (0, vec![String::new()]);
    for c in body.chars() {
        depth += i32::from(c == '{') - i32::from(c == '}');
        match c {
            ',' if depth == 0 => parts.push(String::new()),
            c => parts.last_mut().expect("starts with one").push(c),
        }
    }
    let parts = parts.iter().filter(|p| !p.trim().is_empty());
    parts.flat_map(|p| leaves(p)).map(|leaf| format!("{head}{leaf}")).collect()
}

/// A path as seen from a module, from the crate's root on; `None` for other crates.
fn absolute(path: &str, module: &[String], children: &BTreeSet<String>) -> Option<Vec<String>> {
    let words: Vec<&str> = path.split("::").map(str::trim).collect();
    let mut base = module.to_vec();
    let skip = match words[0] {
        "crate" => {
            base.clear();
            1
        }
        "self" => 1,
        "super" => words.iter().take_while(|w| **w == "super").count(),
        first if children.contains(first) => 0,
        _ => return None,
    };
    if words[0] == "super" {
        base.truncate(base.len().saturating_sub(skip));
    }
    Some(base.into_iter().chain(words[skip..].iter().map(|w| (*w).to_owned())).collect())
}

fn imports(code: &str, module: &[String], children: &BTreeSet<String>) -> Vec<Import> {
    let mut found = Vec::new();
    let mut rest = String::new();
    let mut statement: Option<String> = None;
    for line in code.lines() {
        let begins =
            ["use ", "pub use ", "pub(super) use ", "pub(crate) use "].iter().any(|w| line.trim_start().starts_with(w));
        if statement.is_none() && begins {
            statement = Some(String::new());
        }
        let Some(s) = &mut statement else {
            rest += line;
            rest.push('\n');
            continue;
        };
        s.push_str(line.trim());
        s.push(' ');
        if !line.contains(';') {
            continue;
        }
        let whole = statement.take().expect("just filled");
        let (visible, tree) = whole.split_once("use ").expect("begins so");
        for leaf in leaves(tree.trim().trim_end_matches([';', ' '])) {
            let (path, alias) = leaf.split_once(" as ").map_or((leaf.as_str(), None), |(p, a)| (p, Some(a.trim())));
            let path = path.trim().trim_end_matches("::self");
            if let Some(path) = absolute(path, module, children) {
                let name = alias.unwrap_or(path.last().map_or("", String::as_str)).to_owned();
                found.push(Import { public: !visible.trim().is_empty(), path, name });
            }
        }
    }
    // Paths in the midst of code.
    let word = |c: char| c.is_alphanumeric() || c == '_' || c == ':';
    for path in rest.split(|c| !word(c)).filter(|p| p.contains("::")) {
        let path = path.trim_matches(':');
        if let Some(path) = absolute(path, module, children) {
            found.push(Import { public: false, name: String::new(), path });
        }
    }
    found
}

/// Every file of src/ by its module path.
fn modules(folder: &Path, at: &[String], out: &mut BTreeMap<Module, String>) {
    let mut files = 0;
    for entry in std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()) {
        let name = entry.file_stem().unwrap().to_string_lossy().into_owned();
        let inside = || at.iter().cloned().chain([name.clone()]).collect::<Vec<_>>();
        if entry.is_dir() {
            modules(&entry, &inside(), out);
            continue;
        }
        files += 1;
        if entry.extension().is_some_and(|e| e == "rs") {
            let module = if name == "mod" || name == "lib" { at.to_vec() } else { inside() };
            out.insert(module, code(&std::fs::read_to_string(&entry).unwrap()));
        }
    }
    assert!(files <= MOST_FILES, "{}: {files} files at one level, limit {MOST_FILES}; make rooms", folder.display());
}

/// What each file takes from which others; a doorway's `pub use` is followed to the file that it names.
fn graph(all: &BTreeMap<Module, String>) -> BTreeMap<Module, BTreeSet<Module>> {
    let children = |m: &Module| {
        let inside = all.keys().filter(|c| c.len() == m.len() + 1 && c.starts_with(m));
        inside.filter_map(|c| c.last().cloned()).collect::<BTreeSet<String>>()
    };
    let said: BTreeMap<&Module, Vec<Import>> = all.iter().map(|(m, c)| (m, imports(c, m, &children(m)))).collect();
    let mut doors: BTreeMap<Vec<String>, Vec<String>> = BTreeMap::new();
    for (module, list) in &said {
        for i in list.iter().filter(|i| i.public) {
            doors.insert(module.iter().cloned().chain([i.name.clone()]).collect(), i.path.clone());
        }
    }
    let follow = |path: &[String]| {
        let mut path = path.to_vec();
        for _ in 0..8 {
            let hit = (1..=path.len()).rev().find(|&n| {
                // `batch` may be a room and the function that its doorway shows: where the path goes on, it is the
                // room.
                let room = n < path.len() && all.contains_key(&path[..n]);
                !room && doors.contains_key(&path[..n])
            });
            let Some(n) = hit else { break };
            path = doors[&path[..n]].iter().chain(&path[n..]).cloned().collect();
        }
        path
    };
    let file_of = |path: &[String]| (0..=path.len()).rev().map(|n| path[..n].to_vec()).find(|m| all.contains_key(m));
    let of = |(module, list): (&&Module, &Vec<Import>)| {
        let inward = |i: &Import| i.public && i.path.starts_with(module);
        let used = list.iter().filter(|i| !inward(i)).filter_map(|i| file_of(&follow(&i.path)));
        ((*module).clone(), used.filter(|m| m != *module).collect())
    };
    said.iter().map(of).collect()
}

/// A circle through `start`, if there is one.
fn circle(graph: &BTreeMap<Module, BTreeSet<Module>>, start: &Module) -> Option<Vec<Module>> {
    let mut ways: Vec<Vec<Module>> = vec![vec![start.clone()]];
    let mut seen = BTreeSet::new();
    while let Some(way) = ways.pop() {
        for next in &graph[way.last().expect("starts with one")] {
            if next == start {
                return Some(way);
            }
            if seen.insert(next.clone()) {
                ways.push(way.iter().cloned().chain([next.clone()]).collect());
            }
        }
    }
    None
}

#[test]
fn no_two_files_import_each_other_in_a_circle_and_rooms_stay_small() {
    for package in ["src", "program/src"] {
        let mut all = BTreeMap::new();
        modules(&Path::new(env!("CARGO_MANIFEST_DIR")).join(package), &[], &mut all);
        assert!(all.len() > 100, "{package}: {} files", all.len());
        let graph = graph(&all);
        let circles: BTreeSet<Vec<String>> = graph
            .keys()
            .filter_map(|m| circle(&graph, m))
            .map(|c| c.iter().map(|m| m.join("::")).collect::<BTreeSet<_>>().into_iter().collect())
            .collect();
        assert!(circles.is_empty(), "{package}: files that import each other:\n{circles:#?}");
    }
}

#[test]
fn imports_are_followed_through_doorways() {
    let text = |s: &str| code(s);
    let all = BTreeMap::from([
        (vec![], String::new()),
        (vec!["a".into()], text("pub use one::Thing;\npub mod one;\nmod two;")),
        (vec!["a".into(), "one".into()], text("use super::two::{Other, more::Far}; // use crate::b::Never")),
        (
            vec!["a".into(), "two".into()],
            text("fn f() { crate::a::Thing::new() }\n#[cfg(test)]\nmod tests { use crate::b; }"),
        ),
        (vec!["b".into()], text("use crate::a::Thing as T;")),
    ]);
    let graph = graph(&all);
    let m = |s: &str| s.split("::").map(str::to_owned).collect::<Module>();
    assert_eq!(graph[&m("a::one")], BTreeSet::from([m("a::two")]));
    assert_eq!(graph[&m("a::two")], BTreeSet::from([m("a::one")]));
    assert_eq!(graph[&m("b")], BTreeSet::from([m("a::one")]));
    assert!(graph[&m("a")].is_empty());
    assert!(circle(&graph, &m("a::one")).is_some() && circle(&graph, &m("b")).is_none());
}

#[test]
fn a_room_wins_over_the_function_of_its_name() {
    let all = BTreeMap::from([
        (vec![], code("pub mod batch;\npub use batch::batch;")),
        (vec!["batch".into()], code("mod files;\nmod run;\npub use run::{Row, batch};")),
        (vec!["batch".into(), "files".into()], code("use super::run::Row;")),
        (vec!["batch".into(), "run".into()], code("use super::files::write;")),
        (vec!["user".into()], code("use crate::batch::batch;\nfn f() { crate::batch::Row::new() }")),
    ]);
    let graph = graph(&all);
    let m = |s: &str| s.split("::").map(str::to_owned).collect::<Module>();
    assert_eq!(graph[&m("batch::files")], BTreeSet::from([m("batch::run")]));
    assert_eq!(graph[&m("user")], BTreeSet::from([m("batch::run")]));
    assert!(circle(&graph, &m("batch::run")).is_some());
}
