//! No file needs, by way of others, a file that needs it: such circles are read all at once or not at all.
//!
//! A file needs those whose items it imports or names. Traits and constants of a `mod.rs` do not count: a trait is there to be
//! implemented below it, and a constant needs nothing.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use super::imports::all_sources;

type Module = Vec<String>;

/// A file's module, and its code without comments and unit tests.
fn modules() -> BTreeMap<Module, (String, bool)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut all = BTreeMap::new();
    for path in all_sources() {
        let inner = path.strip_prefix(&root).unwrap().with_extension("");
        let mut module: Module = inner.iter().map(|part| part.to_str().unwrap().to_string()).collect();
        let is_folder = module.last().is_some_and(|last| last == "mod");
        if is_folder || module == ["lib"] {
            module.pop();
        }
        if module == ["main"] {
            continue;
        }
        let text = fs::read_to_string(&path).unwrap();
        let tests = text.match_indices("\n#[cfg(test)]\n").map(|(at, _)| at).find(|at| {
            text[*at..].lines().nth(2).is_some_and(|line| line.contains("mod ") && line.ends_with('{'))
        });
        let code = &text[..tests.unwrap_or(text.len())];
        let code =
            code.lines().map(|line| line.split("//").next().unwrap_or("")).collect::<Vec<_>>().join("\n");
        all.insert(module, (code, is_folder));
    }
    all
}

/// The paths of a tree of imports: `a::{b, c::d}` has `a::b` and `a::c::d`.
fn flat(tree: &str) -> Vec<String> {
    let tree = tree.trim();
    let Some(open) = tree.find('{') else { return vec![tree.to_string()] };
    let inner = &tree[open + 1..tree.rfind('}').unwrap()];
    let (mut parts, mut depth, mut start) = (Vec::new(), 0, 0);
    for (at, letter) in inner.char_indices() {
        match letter {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => {
                parts.push(&inner[start..at]);
                start = at + 1;
            }
            _ => {}
        }
    }
    parts.push(&inner[start..]);
    let parts = parts.into_iter().filter(|part| !part.trim().is_empty());
    parts.flat_map(flat).map(|path| format!("{}{path}", tree[..open].trim())).collect()
}

/// Imports of a file: whether they are passed on (`pub use`), and their paths; and the rest of the code.
fn imports(code: &str) -> (Vec<(bool, String)>, String) {
    let (mut all, mut rest) = (Vec::new(), String::new());
    let mut lines = code.lines();
    while let Some(line) = lines.next() {
        let begun = line.trim_start();
        let is_public = begun.starts_with("pub");
        let Some(at) = begun
            .find("use ")
            .filter(|at| *at == 0 || is_public && begun[..*at].trim().split(' ').count() <= 3)
        else {
            rest.push_str(line);
            rest.push('\n');
            continue;
        };
        let mut statement = begun[at + 4..].to_string();
        while !statement.contains(';') {
            let Some(next) = lines.next() else { break };
            statement.push_str(next.trim());
        }
        let tree = statement.split(';').next().unwrap().to_string();
        all.extend(flat(&tree).into_iter().map(|path| (is_public, path)));
    }
    (all, rest)
}

/// A path seen from a module, from the crate's root; none for other crates.
fn absolute(path: &str, module: &Module, all: &BTreeMap<Module, (String, bool)>) -> Option<Module> {
    let mut parts: Module =
        path.split("::").map(|part| part.split(" as ").next().unwrap().trim().to_string()).collect();
    let mut from = module.clone();
    match parts[0].as_str() {
        "crate" => from.clear(),
        "super" => {
            while parts.first().is_some_and(|part| part == "super") {
                from.pop()?;
                parts.remove(0);
            }
            return Some([from, parts].concat());
        }
        "self" => {}
        child => {
            from.push(child.to_string());
            return all.contains_key(&from).then(|| [module.clone(), parts].concat());
        }
    }
    parts.remove(0);
    Some([from, parts].concat())
}

/// Splits a path into the module that it leads to and the item's name.
fn target(path: &Module, all: &BTreeMap<Module, (String, bool)>) -> (Module, Option<String>) {
    let depth = (0..=path.len()).rev().find(|&depth| all.contains_key(&path[..depth])).unwrap_or(0);
    (path[..depth].to_vec(), path.get(depth).cloned())
}

/// Which modules each needs.
fn needs() -> BTreeMap<Module, BTreeSet<Module>> {
    let all = modules();
    let mut passed_on = BTreeMap::new();
    // What a module passes on whole (`pub use other::*`).
    let mut passed_whole: BTreeMap<Module, Vec<Module>> = BTreeMap::new();
    let mut named = BTreeMap::new();
    for (module, (code, _)) in &all {
        let (imports, rest) = imports(code);
        let mut paths = Vec::new();
        for (is_public, path) in imports {
            let Some(found) = absolute(&path, module, &all) else { continue };
            if is_public {
                let name =
                    path.rsplit(" as ").next().unwrap().rsplit("::").next().unwrap().trim().to_string();
                if name == "*" {
                    passed_whole.entry(module.clone()).or_default().push(target(&found, &all).0);
                } else {
                    passed_on.insert((module.clone(), name), found);
                }
            } else {
                paths.push(found);
            }
        }
        for root in ["crate::", "super::", "self::"] {
            for (at, _) in rest.match_indices(root) {
                let before = rest[..at].chars().next_back();
                // `pub(in crate::room)` says who may use an item, not what it needs.
                let is_visibility = rest[..at].ends_with("pub(in ");
                if is_visibility
                    || before.is_some_and(|c| c.is_alphanumeric() || c == '_' || c == ':' || c == '$')
                {
                    continue;
                }
                let length = rest[at..].find(|c: char| !(c.is_alphanumeric() || c == '_' || c == ':'));
                let path = rest[at..at + length.unwrap_or(rest.len() - at)].trim_end_matches(':');
                paths.extend(absolute(path, module, &all));
            }
        }
        named.insert(module.clone(), paths);
    }
    let mut needs = BTreeMap::new();
    for (module, paths) in named {
        let mut of = BTreeSet::new();
        for path in paths {
            let (mut to, mut item) = target(&path, &all);
            // To where it is declared.
            while let Some(next) = item.clone().and_then(|name| passed_on.get(&(to.clone(), name))) {
                (to, item) = target(next, &all);
            }
            let (code, is_folder) = &all[&to];
            let declares = |kind: &str| {
                item.as_ref().is_some_and(|name| {
                    code.lines().any(|line| {
                        let line = line.trim_start();
                        let line = line.strip_prefix("pub").map_or(line, |rest| {
                            let rest = if rest.starts_with('(') {
                                rest.split_once(')').map_or("", |(_, rest)| rest)
                            } else {
                                rest
                            };
                            rest.trim_start()
                        });
                        line.strip_prefix(kind).is_some_and(|rest| {
                            rest.strip_prefix(name.as_str()).is_some_and(|rest| {
                                !rest.starts_with(|c: char| c.is_alphanumeric() || c == '_')
                            })
                        })
                    })
                })
            };
            let is_free = *is_folder && (declares("trait ") || declares("const ") || declares("static "));
            if item.as_deref() == Some("*") {
                of.extend(passed_whole.get(&to).into_iter().flatten().filter(|to| **to != module).cloned());
            }
            if to != module && !to.is_empty() && !is_free {
                of.insert(to);
            }
        }
        needs.insert(module, of);
    }
    needs
}

/// Modules that need themselves by way of others, in groups (Tarjan's strongly connected components, by two searches).
fn circles(needs: &BTreeMap<Module, BTreeSet<Module>>) -> Vec<Vec<&Module>> {
    let reached = |from: &Module| {
        let (mut seen, mut open) = (BTreeSet::new(), vec![from.clone()]);
        while let Some(next) = open.pop() {
            for to in needs.get(&next).into_iter().flatten() {
                if seen.insert(to.clone()) {
                    open.push(to.clone());
                }
            }
        }
        seen
    };
    let all: BTreeMap<&Module, BTreeSet<Module>> =
        needs.keys().map(|module| (module, reached(module))).collect();
    let (mut done, mut groups) = (BTreeSet::new(), Vec::new());
    for (module, reach) in &all {
        if !reach.contains(*module) || done.contains(*module) {
            continue;
        }
        let group: Vec<&Module> = all
            .keys()
            .copied()
            .filter(|other| reach.contains(*other) && all[other].contains(*module))
            .collect();
        done.extend(group.iter().copied());
        groups.push(group);
    }
    groups
}

#[test]
fn files_need_each_other_in_no_circle() {
    let needs = needs();
    let groups = circles(&needs);
    let name = |module: &Module| module.join("::");
    let within = |group: &Vec<&Module>, module: &Module| {
        let inside = needs[module].iter().filter(|to| group.contains(to)).map(name).collect::<Vec<_>>();
        format!("{} needs {}", name(module), inside.join(", "))
    };
    let said = groups
        .iter()
        .map(|group| group.iter().map(|module| within(group, module)).collect::<Vec<_>>().join("\n"));
    let said: Vec<String> = said.collect();
    assert!(groups.is_empty(), "{} circles:\n{}", groups.len(), said.join("\n\n"));
}

#[test]
fn circles_are_found() {
    let module = |name: &str| vec![name.to_string()];
    let needs = [("a", "b"), ("b", "c"), ("c", "a"), ("d", "a")];
    let needs = needs.map(|(from, to)| (module(from), BTreeSet::from([module(to)]))).into_iter().collect();
    let groups = circles(&needs);
    assert_eq!(groups, [vec![&module("a"), &module("b"), &module("c")]]);
    assert_eq!(flat("a::{b, c::{d, e}}"), ["a::b", "a::c::d", "a::c::e"]);
}
