//! In: the shaders and what the Rust side says about them. Out: they agree: entry point, workgroup,
//! bindings, byte layout, overrides; no shader without a stage. Frame and unit: bytes.

use naga::{AddressSpace, StorageAccess, TypeInner};
use sheetlight::gpu::Access;
use sheetlight::stages;
use std::collections::BTreeSet;

#[test]
fn every_shader_is_what_its_stage_says() {
    for entry in stages::all() {
        let stage = entry.stage;
        let module = valid(stage.name, &stage.source());
        // What a software adapter is given: images in place of these arrays, and no other binding.
        let texels = stage.tree(true, &[]);
        validated(stage.name, &texels);
        let images = stage.bindings.iter().filter(|b| b.access == Access::Texels).count();
        let is_image = |g: &naga::GlobalVariable| matches!(texels.types[g.ty].inner, TypeInner::Image { .. });
        let seen = texels.global_variables.iter().filter(|(_, g)| is_image(g)).count();
        assert!(seen <= images, "{}: {seen} images of {images} bindings", stage.name);
        let arrays = stage.bindings.iter().filter(|b| b.access == Access::Texels).map(|b| b.name);
        for name in arrays {
            let left = texels.global_variables.iter().any(|(_, g)| g.name.as_deref() == Some(name));
            assert!(!left, "{}: '{name}' is read otherwise than element by element", stage.name);
        }
        assert_eq!(module.entry_points.len(), 1, "{}", stage.name);
        let main = &module.entry_points[0];
        assert_eq!((main.name.as_str(), main.workgroup_size), ("main", stage.workgroup), "{}", stage.name);
        let overrides: BTreeSet<_> = module.overrides.iter().filter_map(|(_, o)| o.name.as_deref()).collect();
        assert_eq!(overrides, stage.overrides.iter().copied().collect(), "{}", stage.name);
        let bound: Vec<_> = module.global_variables.iter().filter(|(_, g)| g.binding.is_some()).collect();
        assert_eq!(bound.len(), stage.bindings.len(), "{}: bindings", stage.name);
        for (_, global) in bound {
            let at = global.binding.as_ref().unwrap();
            let name = global.name.as_deref().unwrap();
            let place = format!("{}: binding {name}", stage.name);
            assert_eq!(at.group, 0, "{place}");
            let said = stage.bindings[at.binding as usize];
            assert_eq!(said.name, name, "{place}");
            let access = match global.space {
                AddressSpace::Uniform => Access::Uniform,
                AddressSpace::Storage { access } if access.contains(StorageAccess::STORE) => Access::ReadWrite,
                AddressSpace::Storage { .. } if said.access == Access::Texels => Access::Texels,
                AddressSpace::Storage { .. } => Access::Read,
                other => panic!("{place}: address space {other:?}"),
            };
            assert_eq!(said.access, access, "{place}");
            if access == Access::Uniform {
                let ty = &module.types[global.ty];
                let TypeInner::Struct { members, span } = &ty.inner else { panic!("{place}: not a struct") };
                let (struct_name, fields, size) = stage.uniform;
                assert_eq!(ty.name.as_deref(), Some(struct_name), "{place}");
                assert_eq!(*span as usize, size, "{place}: size");
                let seen: Vec<_> = members.iter().map(|m| (m.name.as_deref().unwrap(), m.offset as usize)).collect();
                let told: Vec<_> = fields.iter().map(|f| (f.name, f.offset)).collect();
                assert_eq!(seen, told, "{place}");
            }
        }
    }
}

/// Scalar constants of a shader's text: name, value.
fn constants(text: &str) -> Vec<(String, f64)> {
    let lines = text.lines().filter_map(|l| l.split("//").next()?.trim().strip_prefix("const "));
    let one = |line: &str| -> Option<(String, f64)> {
        let (name, value) = line.trim_end_matches(';').split_once(" = ")?;
        let value = value.trim();
        let number = match value.strip_prefix("0x") {
            Some(hex) => i64::from_str_radix(hex.trim_end_matches(['u', 'i']), 16).ok()? as f64,
            None => value.trim_end_matches(['u', 'i', 'f']).parse().ok()?,
        };
        Some((name.split(':').next()?.trim().into(), number))
    };
    lines.filter_map(one).collect()
}

/// Words that are read by a number instead of a name: `header[3]`, and reasons that are numbers.
fn literals(text: &str) -> Vec<String> {
    let read = |name: &'static str| {
        text.match_indices(name).filter(move |(at, found)| {
            let whole = !text[..*at].ends_with(|c: char| c.is_alphanumeric() || c == '_');
            whole && text[at + found.len()..].starts_with(|c: char| c.is_ascii_digit())
        })
    };
    let all = ["header[", "listing[", "all[", "shortened[", "others[", "first[", "select(why, ", "flags & "];
    all.iter().flat_map(|name| read(name)).map(|(at, _)| text[at..].chars().take(24).collect()).collect()
}

#[test]
fn numbers_of_both_sides_are_one_and_have_names() {
    let mut seen = BTreeSet::new();
    for entry in stages::all() {
        let (stage, text) = (entry.stage.name, entry.stage.source());
        assert_eq!(literals(&text), [""; 0], "{stage}: name these words, in shaders/shared and src/stages/numbers.rs");
        for (name, value) in constants(&text) {
            let place = stages::NUMBERS.iter().position(|n| n.1 == name && [stage, ""].contains(&n.0));
            let at = place.unwrap_or_else(|| panic!("{stage}: {name} stands in no line of src/stages/numbers.rs"));
            assert_eq!(value as f32, stages::NUMBERS[at].2 as f32, "{stage}: {name}");
            seen.insert(at);
        }
    }
    let unused: Vec<_> = (0..stages::NUMBERS.len()).filter(|i| !seen.contains(i)).collect();
    assert!(unused.is_empty(), "no shader names these: {unused:?}");
}

#[test]
fn literals_and_constants_are_read_in_every_form() {
    let text =
        "const A = 3u;\nconst B: i32 = 0x10; // const C = 4u;\nconst D = vec4(1u);\nlet x = header[COUNT] + header[4];";
    assert_eq!(constants(text), [("A".to_string(), 3.0), ("B".to_string(), 16.0)]);
    assert_eq!(literals(text), ["header[4];"]);
    assert_eq!(literals("my_header[4] + select(why, 6u, x)").len(), 1);
}

fn valid(name: &str, source: &str) -> naga::Module {
    let module =
        naga::front::wgsl::parse_str(source).unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(source)));
    validated(name, &module);
    module
}

fn validated(name: &str, module: &naga::Module) {
    let mut validator =
        naga::valid::Validator::new(naga::valid::ValidationFlags::all(), naga::valid::Capabilities::empty());
    validator.validate(module).unwrap_or_else(|e| panic!("{name}: {e:?}"));
}

/// Loops run without a limit on their turns (gpu::Stage): each has to count to its end, or stands here with the
/// reason why it ends.
#[test]
fn every_loop_ends() {
    let others = [
        ("lengthen", "while bits != 0u", "a bit is cleared a turn"),
        ("lengthen", "while t <= last", "t grows by one a turn, last is set to less than t at most"),
        ("peak", "while left > 0u", "left shrinks by one a turn, or is set to zero"),
        ("skeleton", "while bits != 0u && at < frame.capacity", "a bit is cleared a turn"),
        ("spacing", "while bits != 0u", "a bit is cleared a turn"),
        ("support", "for (var left = end - i; left > 0u;)", "left is halved a turn"),
        ("support", "for (; i < end; i++)", "i counts to end"),
        ("tiles", "while left != 0u", "at least the lowest bit is cleared a turn"),
    ];
    let mut seen = BTreeSet::new();
    let mut counted = 0;
    for stage in stages::all().iter().map(|e| e.stage) {
        for line in stage.source().lines().map(|l| l.split("//").next().unwrap().trim()) {
            let word = line.split([' ', '(', '{']).next().unwrap();
            assert!(word != "loop", "{}: {line}", stage.name);
            if !matches!(word, "for" | "while") {
                continue;
            }
            let head = line.trim_end_matches('{').trim();
            if others.iter().any(|o| (o.0, o.1) == (stage.name, head)) {
                seen.insert((stage.name, head.to_string()));
                continue;
            }
            let parts: Vec<&str> = head.trim_start_matches("for (").trim_end_matches(')').split("; ").collect();
            let name = parts[0].strip_prefix("var ").and_then(|p| p.split_once(" = ")).map_or("?", |p| p.0);
            let [_, until, step] = parts[..] else { panic!("{}: {head}", stage.name) };
            let steps = step.strip_prefix(name).is_some_and(|s| {
                ["++", "--", " = 0u"].contains(&s) || s.strip_prefix(" += ").is_some_and(|by| by != "0" && by != "0u")
            });
            let tested = until.split(' ').any(|w| w == name);
            assert!(steps && tested, "{}: no loop that counts to its end: {head}", stage.name);
            counted += 1;
        }
    }
    assert!(counted > 50 && seen.len() == others.len(), "{counted} loops that count; seen {seen:?}");
}

#[test]
fn no_shader_is_an_orphan() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("shaders");
    let files: BTreeSet<String> = std::fs::read_dir(folder)
        .unwrap()
        .map(|f| f.unwrap().path())
        .filter(|p| p.extension().is_some_and(|e| e == "wgsl"))
        .map(|p| p.file_stem().unwrap().to_string_lossy().into_owned())
        .collect();
    let stages: BTreeSet<String> = stages::all().iter().map(|e| e.stage.name.to_string()).collect();
    assert_eq!(files, stages);
}
