//! The rooms of the house, read from the sources: which modules lean on each other in a circle, and whether the crates lean on
//! each other as docs/architecture.md has them.

use crate::support::root;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use syn::visit::Visit;

/// Path of a module inside its crate, from the crate's root.
type Module = Vec<String>;

/// What one module takes from other modules of its crate, as written: absolute paths.
struct Uses {
    module: Module,
    paths: BTreeSet<Module>,
    /// Items that the module passes on under a name of its own.
    passed_on: BTreeMap<String, Module>,
    /// Names of the types and functions that it defines.
    defined: BTreeSet<String>,
}

impl Uses {
    /// A path as written, from the root of the crate; none where it leads out of it.
    fn absolute(&self, path: &[String]) -> Option<Module> {
        let supers = path.iter().take_while(|part| *part == "super").count();
        let own = self.module.len();
        match path.first().map(String::as_str) {
            Some("crate") => Some(path[1..].to_vec()),
            Some("self") => Some([&self.module, &path[1..]].concat()),
            Some("super") if supers <= own => Some([&self.module[..own - supers], &path[supers..]].concat()),
            _ => None,
        }
    }

    fn tree(&mut self, tree: &syn::UseTree, mut path: Module, public: bool) {
        match tree {
            syn::UseTree::Path(part) => {
                path.push(part.ident.to_string());
                self.tree(&part.tree, path, public);
            }
            syn::UseTree::Group(group) => {
                group.items.iter().for_each(|item| self.tree(item, path.clone(), public));
            }
            syn::UseTree::Name(name) => self.used(&path, &name.ident, &name.ident, public),
            syn::UseTree::Rename(new) => self.used(&path, &new.ident, &new.rename, public),
            syn::UseTree::Glob(_) => self.paths.extend(self.absolute(&path)),
        }
    }

    fn used(&mut self, path: &[String], item: &syn::Ident, name: &syn::Ident, public: bool) {
        let full = [path, &[item.to_string()]].concat();
        // In the file that declares a module its name alone is a path.
        let absolute = self.absolute(&full).unwrap_or_else(|| [&self.module[..], &full].concat());
        if public {
            self.passed_on.insert(name.to_string(), absolute.clone());
        }
        self.paths.insert(absolute);
    }
}

impl<'ast> Visit<'ast> for Uses {
    fn visit_item(&mut self, item: &'ast syn::Item) {
        let (attributes, defined) = match item {
            syn::Item::Mod(m) => (&m.attrs, None),
            syn::Item::Use(u) => (&u.attrs, None),
            syn::Item::Fn(f) => (&f.attrs, Some(&f.sig.ident)),
            syn::Item::Struct(s) => (&s.attrs, Some(&s.ident)),
            syn::Item::Enum(e) => (&e.attrs, Some(&e.ident)),
            _ => return syn::visit::visit_item(self, item),
        };
        let is_test = |a: &syn::Attribute| {
            a.path().is_ident("cfg") && a.parse_args::<syn::Ident>().is_ok_and(|what| what == "test")
        };
        if !attributes.iter().any(is_test) {
            self.defined.extend(defined.map(ToString::to_string));
            syn::visit::visit_item(self, item);
        }
    }

    fn visit_item_use(&mut self, item: &'ast syn::ItemUse) {
        let public = !matches!(item.vis, syn::Visibility::Inherited);
        self.tree(&item.tree, Vec::new(), public);
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        let parts: Module = path.segments.iter().map(|s| s.ident.to_string()).collect();
        self.paths.extend(self.absolute(&parts));
        syn::visit::visit_path(self, path);
    }
}

/// The modules of a crate, by their files; what only tests have is left out.
fn modules(source: &Path) -> Vec<Uses> {
    let mut folders = vec![(source.to_path_buf(), Module::new())];
    let mut all = Vec::new();
    while let Some((folder, module)) = folders.pop() {
        for entry in std::fs::read_dir(&folder).expect("a folder of sources") {
            let path = entry.expect("an entry").path();
            let stem = path.file_stem().and_then(|s| s.to_str()).expect("a name").to_owned();
            let inner = [&module[..], std::slice::from_ref(&stem)].concat();
            if path.is_dir() && stem != "tests" {
                folders.push((path, inner));
            } else if path.extension().is_some_and(|e| e == "rs") && !stem.ends_with("tests") {
                let own = matches!(stem.as_str(), "lib" | "main" | "mod");
                let text = std::fs::read_to_string(&path).expect("a source");
                let file = syn::parse_file(&text).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
                let module = if own { module.clone() } else { inner };
                let (paths, passed_on, defined) = Default::default();
                let mut uses = Uses { module, paths, passed_on, defined };
                uses.visit_file(&file);
                all.push(uses);
            }
        }
    }
    all
}

/// The module that a path leads into, items that are passed on followed to where they are.
fn home(path: &[String], known: &BTreeMap<&Module, BTreeMap<String, Module>>, depth: usize) -> Module {
    let longest = (0..=path.len()).rev().find(|n| known.contains_key(&path[..*n].to_vec())).unwrap_or(0);
    let module = path[..longest].to_vec();
    let passed = path.get(longest).and_then(|item| known.get(&module)?.get(item));
    match passed {
        Some(from) if depth > 0 && from != path => home(from, known, depth - 1),
        _ => module,
    }
}

/// Circles among the modules that are beside each other in one folder, of every folder of a crate.
fn circles(name: &str) -> BTreeSet<String> {
    let all = modules(&root().join("crates").join(name).join("src"));
    let mut known: BTreeMap<&Module, BTreeMap<String, Module>> = BTreeMap::new();
    for uses in &all {
        // The root of a library and that of its program are one module.
        known.entry(&uses.module).or_default().extend(uses.passed_on.clone());
    }
    let mut arrows: BTreeMap<Module, BTreeMap<String, BTreeSet<String>>> = BTreeMap::new();
    for uses in &all {
        for path in &uses.paths {
            let to = home(path, &known, 8);
            let same = uses.module.iter().zip(&to).take_while(|(a, b)| a == b).count();
            if let (Some(a), Some(b)) = (uses.module.get(same), to.get(same)) {
                let folder = arrows.entry(to[..same].to_vec()).or_default();
                folder.entry(a.clone()).or_default().insert(b.clone());
            }
        }
    }
    let in_folder = |(folder, arrows): (&Module, &BTreeMap<String, BTreeSet<String>>)| {
        let place = [&[name.to_owned()], &folder[..]].concat().join("/");
        tied(arrows).into_iter().map(|circle| format!("{place}: {}", circle.join(" "))).collect::<Vec<_>>()
    };
    arrows.iter().flat_map(in_folder).collect()
}

/// Sets of rooms each of which leads to every other one, of more than one room.
fn tied(arrows: &BTreeMap<String, BTreeSet<String>>) -> BTreeSet<Vec<String>> {
    let reach = |from: &String| {
        let (mut seen, mut next) = (BTreeSet::new(), vec![from]);
        while let Some(room) = next.pop() {
            let new = arrows.get(room).into_iter().flatten().filter(|to| seen.insert(*to));
            next.extend(new.collect::<Vec<_>>());
        }
        seen
    };
    let reached: BTreeMap<&String, BTreeSet<&String>> = arrows.keys().map(|r| (r, reach(r))).collect();
    let circle = |room: &&String| -> Vec<String> {
        let back = |to: &&&String| reached.get(*to).is_some_and(|all| all.contains(*room));
        reached[*room].iter().filter(back).map(|to| (*to).clone()).collect()
    };
    arrows.keys().map(|room| circle(&room)).filter(|circle| circle.len() > 1).collect()
}

#[test]
fn circles_are_found() {
    let arrows =
        [("a", vec!["b"]), ("b", vec!["c"]), ("c", vec!["a", "d"]), ("d", vec!["d"]), ("e", vec!["a"])];
    let arrows: BTreeMap<String, BTreeSet<String>> = arrows
        .into_iter()
        .map(|(from, to)| (from.into(), to.into_iter().map(str::to_owned).collect()))
        .collect();
    assert_eq!(tied(&arrows), BTreeSet::from([["a", "b", "c"].map(str::to_owned).to_vec()]));
}

/// What there is today is listed beside this test; the list only shrinks.
#[test]
fn no_room_leans_on_one_that_leans_on_it() {
    let listed = include_str!("support/circles.txt");
    let listed: BTreeSet<String> =
        listed.lines().filter(|l| !l.starts_with('#')).map(str::to_owned).collect();
    let found: BTreeSet<String> = manifests().keys().flat_map(|name| circles(name)).collect();
    let new: Vec<&String> = found.difference(&listed).collect();
    let gone: Vec<&String> = listed.difference(&found).collect();
    assert!(
        new.is_empty() && gone.is_empty(),
        "circles that tests/support/circles.txt does not have: {new:#?}\nthat it has and are no more: {gone:#?}"
    );
}

/// What is in the Cargo.toml of every crate of the workspace, by its folder below `crates`.
fn manifests() -> BTreeMap<String, toml::Table> {
    let mut all = BTreeMap::new();
    for above in ["", "dev/"] {
        for entry in std::fs::read_dir(root().join("crates").join(above)).expect("crates") {
            let entry = entry.expect("an entry");
            let name = format!("{above}{}", entry.file_name().into_string().expect("a name"));
            if let Ok(text) = std::fs::read_to_string(entry.path().join("Cargo.toml")) {
                all.insert(name, text.parse().expect("a manifest"));
            }
        }
    }
    all
}

/// The packages that a crate is made from; what its tests take beside them is not asked.
fn dependencies(manifest: &toml::Table) -> Vec<String> {
    let of_system = manifest.get("target").and_then(toml::Value::as_table);
    let tables = of_system.into_iter().flat_map(|t| t.values()).filter_map(toml::Value::as_table);
    let kinds = ["dependencies", "build-dependencies"];
    let all = tables.chain([manifest]).flat_map(|table| kinds.map(|kind| table.get(kind)));
    all.flatten().filter_map(toml::Value::as_table).flat_map(|t| t.keys().cloned()).collect()
}

/// The list of crates is the house: none is missing, and each leans only on those before it.
#[test]
fn the_crates_lean_on_each_other_as_the_map_has_them() {
    let map = std::fs::read_to_string(root().join("docs/architecture.md")).expect("the map");
    let rows = map.lines().filter_map(|line| line.strip_prefix("| `")?.split_once("` |"));
    let listed: Vec<&str> = rows.map(|(name, _)| name).collect();
    let manifests = manifests();
    let mut sorted = listed.clone();
    sorted.sort_unstable();
    assert_eq!(sorted, manifests.keys().collect::<Vec<_>>(), "the crates that docs/architecture.md lists");
    let package = |name: &str| manifests[name]["package"]["name"].as_str().expect("a name").to_owned();
    let packages: Vec<String> = listed.iter().map(|name| package(name)).collect();
    for (at, name) in listed.iter().enumerate() {
        let needs = dependencies(&manifests[*name]);
        let up: Vec<&String> = packages[at..].iter().filter(|above| needs.contains(above)).collect();
        assert!(up.is_empty(), "{name} leans on {up:?}, which docs/architecture.md has above it");
    }
}

/// Words of earlier versions for what the field has terms for; the term is the second.
const TERMS: [(&str, &str); 20] = [
    ("Bench", "RefitSession"),
    ("Doubtful", "CompletedWithWarnings"),
    ("Gate", "SignificanceTest"),
    ("Knowers", "ParameterScope"),
    ("Levers", "Sensitivities"),
    ("Moment", "a state or a sample: a moment is a torque"),
    ("PastModel", "StoredModel"),
    ("PastObservations", "StoredObservations"),
    ("PastRun", "StoredRun"),
    ("Placing", "EffectContext"),
    ("Room", "ConditionedProblem"),
    ("Rooms", "ConditionedProblems"),
    ("Settled", "Converged"),
    ("Shares", "TorqueTerms"),
    ("Turn", "Fold"),
    ("Word", "JointReference"),
    ("nobodys", "unobserved"),
    ("perceive", "preprocess"),
    ("receipts", "completion markers"),
    ("tamed", "regularised"),
];

#[test]
fn types_functions_and_modules_have_the_terms_of_the_field() {
    let mut wrong = Vec::new();
    for manifest in manifests().keys() {
        for module in modules(&root().join("crates").join(manifest).join("src")) {
            let own = module.module.last().cloned().unwrap_or_default();
            for (word, term) in TERMS {
                if module.defined.contains(word) || own == word {
                    wrong.push(format!("{manifest}: {} in {}: {term}", word, module.module.join("::")));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}
