//! In: a stage and its WGSL text. Out: everything in which the two disagree.

use crate::case::Case;
use crate::error::{Error, Kind};
use crate::layout::{Layout, Shape};
use crate::stage::{Access, Stage};
use wgpu::naga;
use wgpu::naga::back::pipeline_constants::process_overrides;
use wgpu::naga::proc::GlobalCtx;
use wgpu::naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};
use wgpu::naga::{
    AddressSpace, ArraySize, GlobalVariable, Handle, Module, ShaderStage, StorageAccess, Type, TypeInner,
};

/// A text as naga understands it, or its message.
pub(crate) fn parsed(wgsl: &str) -> Result<(Module, ModuleInfo), String> {
    let module = naga::front::wgsl::parse_str(wgsl).map_err(|e| e.emit_to_string(wgsl))?;
    // What the adapter lacks is refused by the device.
    let mut validator = Validator::new(ValidationFlags::all(), Capabilities::all());
    let info = validator.validate(&module).map_err(|e| e.emit_to_string(wgsl))?;
    Ok((module, info))
}

/// Everything in which a stage's declaration disagrees with its text.
pub(crate) fn disagreements(stage: &Stage, cases: &[Case]) -> Vec<Error> {
    let mut found = Vec::new();
    for binding in &stage.bindings {
        let place = format!("{}: binding '{}'", stage.name, binding.name);
        let tolerances = binding.tolerance.iter().chain(binding.fields.iter().map(|(_, t)| t));
        found.extend(tolerances.filter_map(|t| t.fault()).map(|fault| contract(format!("{place}: {fault}"))));
        if (binding.access == Access::ReadWrite) != binding.tolerance.is_some() {
            let what = format!("{place}: a tolerance is needed exactly where the shader writes");
            found.push(contract(what).next("use Binding::uniform, Binding::read or Binding::read_write"));
        }
        for (name, _) in binding.fields.iter().filter(|(name, _)| !has_field(&binding.shape, name)) {
            found.push(contract(format!("{place}: a tolerance is given for '{name}', which its layout does not have")));
        }
    }
    match parsed(&stage.wgsl) {
        Err(message) => found.push(
            contract(format!("{}: the shader is not valid WGSL: {}", stage.name, message.trim()))
                .next("correct the shader at the line in the message"),
        ),
        Ok((module, info)) => Reader { stage, module: &module, info: &info, found: &mut found }.read(cases),
    }
    found
}

/// The keys by which a pipeline knows override constants: the number of `@id`, or the name.
pub(crate) fn pipeline_keys(module: &Module, overrides: &[(String, f64)]) -> Vec<(String, f64)> {
    let id = |name: &str| module.overrides.iter().find(|(_, o)| o.name.as_deref() == Some(name))?.1.id;
    overrides.iter().map(|(name, value)| (id(name).map_or_else(|| name.clone(), |i| i.to_string()), *value)).collect()
}

fn contract(what: String) -> Error {
    Error::new(Kind::Contract, what)
}

fn has_field(shape: &Shape, name: &str) -> bool {
    let has = |l: &Layout| l.fields.iter().any(|f| f.name == name);
    match shape {
        Shape::One(l) | Shape::Array(l) | Shape::Fixed(l, _) => has(l),
        Shape::Tail(head, _, l) => has(head) || has(l),
    }
}

struct Reader<'a> {
    stage: &'a Stage,
    module: &'a Module,
    info: &'a ModuleInfo,
    found: &'a mut Vec<Error>,
}

impl Reader<'_> {
    fn say(&mut self, what: String, next: &str) {
        self.found.push(contract(format!("{}: {what}", self.stage.name)).next(next));
    }

    fn context(&self) -> GlobalCtx<'_> {
        self.module.to_ctx()
    }

    fn read(mut self, cases: &[Case]) {
        let (stage, module) = (self.stage, self.module);
        let Some(index) = module.entry_points.iter().position(|e| e.name == stage.entry) else {
            let names: Vec<&str> = module.entry_points.iter().map(|e| e.name.as_str()).collect();
            let what = format!("there is no entry point '{}'; the shader has {names:?}", stage.entry);
            return self.say(what, "correct the stage's entry point");
        };
        let entry = &module.entry_points[index];
        if entry.stage != ShaderStage::Compute {
            self.say(format!("'{}' is not a compute shader", stage.entry), "name a function with @compute");
        }
        self.workgroup(entry, cases);
        let mut named: Vec<&str> = module.overrides.iter().filter_map(|(_, o)| o.name.as_deref()).collect();
        let mut told: Vec<&str> = stage.overrides.iter().map(String::as_str).collect();
        named.sort_unstable();
        told.sort_unstable();
        if named != told {
            self.say(format!("override constants are {named:?} in WGSL, {told:?} in Rust"), "correct Stage::overrides");
        }
        let uses = self.info.get_entry_point(index);
        let mut seen = vec![false; stage.bindings.len()];
        for (handle, global) in module.global_variables.iter() {
            let Some(at) = &global.binding else { continue };
            let position = (0..seen.len()).find(|&i| stage.place(i) == (at.group, at.binding));
            let name = global.name.as_deref().unwrap_or("");
            match position {
                Some(position) => {
                    seen[position] = true;
                    self.binding(position, global);
                }
                // What only other entry points use does not concern this stage.
                None if uses[handle].is_empty() => {}
                None => {
                    let what = format!("'{name}' at group {}, binding {} is not declared", at.group, at.binding);
                    self.say(what, "add it to the stage's bindings");
                }
            }
        }
        for position in (0..seen.len()).filter(|&i| !seen[i]) {
            let (group, number) = stage.place(position);
            let name = &stage.bindings[position].name;
            let what = format!("'{name}' is declared at group {group}, binding {number}; WGSL has nothing there");
            self.say(what, "correct the order of the stage's bindings, or Binding::at");
        }
    }

    /// Override constants may decide the size, so that each case may have its own.
    fn workgroup(&mut self, entry: &naga::EntryPoint, cases: &[Case]) {
        let told = self.stage.workgroup;
        let next = "make the two the same: the number of workgroups is computed from it";
        if entry.workgroup_size_overrides.is_none() {
            if entry.workgroup_size != told {
                let what = format!("@workgroup_size is {:?} in WGSL, {told:?} in Rust", entry.workgroup_size);
                self.say(what, next);
            }
            return;
        }
        for case in cases {
            let values = pipeline_keys(self.module, &case.overrides).into_iter().collect();
            let main = Some((ShaderStage::Compute, entry.name.as_str()));
            match process_overrides(self.module, self.info, main, &values) {
                Err(e) => self.say(format!("case '{}': {e}", case.name), "correct the case's override constants"),
                Ok((module, _)) => {
                    let Some(seen) = module.entry_points.iter().find(|e| e.name == entry.name) else { continue };
                    let seen = seen.workgroup_size;
                    if seen != told {
                        let place = format!("case '{}'", case.name);
                        self.say(format!("{place}: @workgroup_size is {seen:?} in WGSL, {told:?} in Rust"), next);
                    }
                }
            }
        }
    }

    fn binding(&mut self, position: usize, global: &GlobalVariable) {
        let told = &self.stage.bindings[position];
        let (group, number) = self.stage.place(position);
        let place = format!("group {group}, binding {number}");
        let name = global.name.as_deref().unwrap_or("");
        if name != told.name {
            let what = format!("{place} is '{name}' in WGSL, '{}' in Rust", told.name);
            self.say(what, "correct the order of the stage's bindings, or Binding::at");
        }
        let access = match global.space {
            AddressSpace::Uniform => Access::Uniform,
            AddressSpace::Storage { access } if access.contains(StorageAccess::STORE) => Access::ReadWrite,
            AddressSpace::Storage { .. } => Access::Read,
            _ => {
                let what = format!("{place}, '{name}', is not a buffer; this kit binds buffers only");
                return self.say(what, "test the arithmetic in a shader that reads a buffer");
            }
        };
        if access != told.access {
            let what = format!("{place}, '{name}', is {} in WGSL, {} in Rust", access.wgsl(), told.access.wgsl());
            self.say(what, "correct the binding's access");
        }
        self.shape(&format!("{place}, '{name}'"), global.ty, &told.shape);
    }

    fn shape(&mut self, place: &str, ty: Handle<Type>, told: &Shape) {
        let inner = &self.module.types[ty].inner;
        match (told, inner) {
            (Shape::One(layout), TypeInner::Array { .. }) => {
                self.say(format!("{place}, is an array in WGSL, one {} in Rust", layout.name), "use Shape::Array");
            }
            (Shape::One(layout), _) => self.value(place, ty, layout),
            (Shape::Array(layout), TypeInner::Array { base, size: ArraySize::Dynamic, stride }) => {
                self.element(place, *base, *stride, layout);
            }
            (Shape::Fixed(layout, n), TypeInner::Array { base, size: ArraySize::Constant(count), stride }) => {
                if count.get() != *n {
                    self.say(format!("{place}, has {count} elements in WGSL, {n} in Rust"), "make the two the same");
                }
                self.element(place, *base, *stride, layout);
            }
            (Shape::Tail(head, name, layout), TypeInner::Struct { members, .. }) => {
                let last = members.last().expect("a WGSL struct has members");
                let tail = &self.module.types[last.ty].inner;
                let TypeInner::Array { base, size: ArraySize::Dynamic, stride } = tail else {
                    return self.say(format!("{place}, does not end in a runtime-sized array"), "use Shape::One");
                };
                if last.name.as_deref() != Some(*name) || last.offset as usize != head.bytes {
                    let seen = last.name.as_deref().unwrap_or("");
                    let what = format!(
                        "{place}, ends in '{seen}' at byte {} in WGSL, in '{name}' at byte {} in Rust",
                        last.offset, head.bytes
                    );
                    self.say(what, "correct the shape's name, or the size of what lies before the array");
                }
                self.members(place, &members[..members.len() - 1], head);
                self.element(&format!("{place}, '{name}'"), *base, *stride, layout);
            }
            _ => {
                let seen = match inner {
                    TypeInner::Array { size: ArraySize::Dynamic, .. } => "a runtime-sized array",
                    TypeInner::Array { .. } => "an array of fixed length",
                    TypeInner::Struct { .. } => "a struct",
                    _ => "one value",
                };
                let told = match told {
                    Shape::One(_) => "one value",
                    Shape::Array(_) => "a runtime-sized array",
                    Shape::Fixed(..) => "an array of fixed length",
                    Shape::Tail(..) => "a struct that ends in a runtime-sized array",
                };
                self.say(format!("{place}, is {seen} in WGSL, {told} in Rust"), "correct the binding's shape");
            }
        }
    }

    fn element(&mut self, place: &str, base: Handle<Type>, stride: u32, layout: &Layout) {
        if stride as usize != layout.bytes {
            let what = format!("{place}, has elements {stride} bytes apart in WGSL, {} in Rust", layout.bytes);
            self.say(what, "pad the Rust type: a vec3 or a struct with one is aligned to 16 bytes in WGSL");
        }
        if !layout.fields.is_empty() {
            self.struct_of(place, base, layout);
        }
    }

    fn value(&mut self, place: &str, ty: Handle<Type>, layout: &Layout) {
        let inner = &self.module.types[ty].inner;
        let bytes = inner.size(self.context()) as usize;
        if bytes != layout.bytes {
            let what = format!("{place}, has {bytes} bytes in WGSL, {} in Rust", layout.bytes);
            self.say(what, "pad the Rust type, or the WGSL struct");
        }
        // Without fields a struct would be compared by its size alone, and two swapped members would pass.
        if matches!(inner, TypeInner::Struct { .. }) || !layout.fields.is_empty() {
            self.struct_of(place, ty, layout);
        }
    }

    fn struct_of(&mut self, place: &str, ty: Handle<Type>, layout: &Layout) {
        match &self.module.types[ty].inner {
            TypeInner::Struct { members, .. } => self.members(place, members, layout),
            _ => {
                self.say(format!("{place}, is no struct in WGSL, the struct {} in Rust", layout.name), "use Layout::of")
            }
        }
    }

    fn members(&mut self, place: &str, members: &[naga::StructMember], layout: &Layout) {
        let size = |m: &naga::StructMember| self.module.types[m.ty].inner.size(self.context()) as usize;
        let seen: Vec<(&str, usize, usize)> =
            members.iter().map(|m| (m.name.as_deref().unwrap_or(""), m.offset as usize, size(m))).collect();
        let told: Vec<(&str, usize, usize)> = layout.fields.iter().map(|f| (f.name, f.offset, f.bytes)).collect();
        if seen == told {
            return;
        }
        let show = |member: Option<&(&str, usize, usize)>| {
            member.map_or("nothing".into(), |(name, at, bytes)| format!("'{name}' at byte {at}, {bytes} bytes"))
        };
        let first = (0..seen.len().max(told.len())).find(|&i| seen.get(i) != told.get(i)).expect("the lists differ");
        let what = format!(
            "{place}, member {first} is {} in WGSL, {} in {}",
            show(seen.get(first)),
            show(told.get(first)),
            layout.name
        );
        self.say(what, "name the members in WGSL's order with layout!, and pad the Rust struct");
    }
}
