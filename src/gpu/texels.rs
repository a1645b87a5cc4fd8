//! In: the naga module of a stage that reads arrays of words. Out: the same module, which reads the same words as
//! texels of an image. Frame and unit: words of 32 bits, alone or in vectors of 2 or 4.
//!
//! Mesa's software adapter reads a storage buffer one lane after the other, in a loop with a branch. It gathers a texel
//! for all lanes at once. For stores the buffer is the faster one. So stages write buffers, and read them as images on
//! the same memory ([`super::alias`]); decision 0012 says how to measure the gain.

use super::description::{Access, Stage};
use naga::proc::TypeResolution;
use naga::valid::{FunctionInfo, ModuleInfo};
use naga::{
    Arena, Block, Expression, Function, GlobalVariable, Handle, Literal, Module, Range, ScalarKind, Span, Statement,
    TypeInner,
};
use std::collections::HashMap;
use wgpu::naga;

/// Texels in a row of such an image, as a power of two: the elements of the buffer fill row after row. 16,384 rows,
/// which every adapter supports, of single words are 256 MiB.
pub(super) const ROW_LOG2: u32 = 12;

/// One texel: a word or four.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Texel {
    One,
    Four,
}

impl Texel {
    pub(super) const ALL: [Texel; 2] = [Texel::One, Texel::Four];

    pub(super) fn bytes(self) -> u64 {
        match self {
            Texel::One => 4,
            Texel::Four => 16,
        }
    }
    pub(super) fn format(self) -> wgpu::TextureFormat {
        match self {
            Texel::One => wgpu::TextureFormat::R32Uint,
            Texel::Four => wgpu::TextureFormat::Rgba32Uint,
        }
    }
    /// The format's name in WGSL.
    fn wgsl(self) -> &'static str {
        match self {
            Texel::One => "r32uint",
            Texel::Four => "rgba32uint",
        }
    }
}

/// An array's element in WGSL, and the texel as which it is read. Texels of two words are slower on the adapter than
/// two texels of one word.
#[derive(Clone, Copy, Debug)]
struct Element {
    ty: &'static str,
    texel: Texel,
}
const ELEMENTS: [Element; 3] = [
    Element { ty: "u32", texel: Texel::One },
    Element { ty: "vec2<u32>", texel: Texel::One },
    Element { ty: "vec4<u32>", texel: Texel::Four },
];

impl Element {
    fn declaration(self, name: &str) -> String {
        format!("var<storage, read> {name}: array<{}>;", self.ty)
    }
    /// WGSL of the image that replaces the array, and of the function that reads element `i` of it.
    fn reader(self, name: &str) -> String {
        let (mask, shift, format) = ((1 << ROW_LOG2) - 1, ROW_LOG2, self.texel.wgsl());
        let load = |index: &str| format!("textureLoad({name}_image, vec2(({index}) & {mask}u, ({index}) >> {shift}u))");
        let value = match self.ty {
            "u32" => format!("{}.x", load("i")),
            "vec2<u32>" => format!("vec2({}.x, {}.x)", load("2u * i"), load("2u * i + 1u")),
            _ => load("i"),
        };
        format!(
            "\nvar {name}_image: texture_storage_2d<{format}, read>;\nfn {name}_texel(i: u32) -> {} {{\n    return \
             {value};\n}}\n",
            self.ty
        )
    }
}

/// The element of a binding's array. Panics if a stage declares `Access::Texels` for any other type.
fn element_of(stage: &Stage, binding: &str) -> Element {
    let found = ELEMENTS.into_iter().find(|e| stage.wgsl.contains(&e.declaration(binding)));
    found.unwrap_or_else(|| {
        panic!(
            "{}: '{binding}' is not a read-only array of u32, vec2<u32> or \
                                    vec4<u32>",
            stage.name
        )
    })
}

/// The texel as which a binding is read.
pub(super) fn texel_of(stage: &Stage, binding: &str) -> Texel {
    element_of(stage, binding).texel
}

/// WGSL of images and readers for a stage's `Access::Texels` bindings, used by [`read_texels`]. It is put before the
/// stage's text, because in a naga module a function comes after those that it calls.
pub(super) fn readers(stage: &Stage) -> String {
    let bindings = stage.bindings.iter().filter(|b| b.access == Access::Texels);
    bindings.map(|b| element_of(stage, b.name).reader(b.name)).collect()
}

/// Gives every image of [`readers`] the binding number of its array, before the module is validated.
pub(super) fn bind_images(module: &mut Module) {
    let bound: HashMap<String, _> = module
        .global_variables
        .iter()
        .filter_map(|(_, g)| Some((format!("{}_image", g.name.as_ref()?), g.binding?)))
        .collect();
    for (_, global) in module.global_variables.iter_mut() {
        if let Some(binding) = global.name.as_ref().and_then(|name| bound.get(name)) {
            global.binding = Some(*binding);
        }
    }
}

/// Replaces every load of an element of an array that has a reader by a call of the reader. The arrays themselves are
/// then unused. `info` is of this module. Returns whether there were readers.
pub(super) fn read_texels(module: &mut Module, info: &ModuleInfo) -> bool {
    let reader = |name: &str| module.functions.iter().find(|(_, f)| f.name.as_deref() == Some(name)).map(|(h, _)| h);
    let readers: Readers = module
        .global_variables
        .iter()
        .filter_map(|(h, g)| Some((h, reader(&format!("{}_texel", g.name.as_ref()?))?)))
        .collect();
    if readers.is_empty() {
        return false;
    }
    let types = module.types.clone();
    let signed = |info: &FunctionInfo, index: Handle<Expression>| {
        let inner = match &info[index].ty {
            TypeResolution::Handle(h) => &types[*h].inner,
            TypeResolution::Value(inner) => inner,
        };
        matches!(inner, TypeInner::Scalar(s) if s.kind == ScalarKind::Sint)
    };
    for (h, f) in module.functions.iter_mut() {
        read_in(f, &readers, &|index| signed(&info[h], index));
    }
    for (i, entry) in module.entry_points.iter_mut().enumerate() {
        read_in(&mut entry.function, &readers, &|index| signed(info.get_entry_point(i), index));
    }
    true
}

/// The function that reads an element, for each array.
type Readers = HashMap<Handle<GlobalVariable>, Handle<Function>>;

/// A call that replaces a load: the function and the index.
struct Call {
    function: Handle<Function>,
    index: Index,
}

#[derive(Clone, Copy)]
enum Index {
    Constant(u32),
    Of(Handle<Expression>),
}

fn read_in(f: &mut Function, readers: &Readers, signed: &dyn Fn(Handle<Expression>) -> bool) {
    let mut calls = HashMap::new();
    let loads: Vec<_> = f
        .expressions
        .iter()
        .filter_map(|(h, e)| if let Expression::Load { pointer } = e { Some((h, *pointer)) } else { None })
        .collect();
    for (load, pointer) in loads {
        let Some((element, call)) = element_of_array(&f.expressions, pointer, readers) else { continue };
        if element == pointer {
            f.expressions[load] = Expression::CallResult(call.function);
            calls.insert(load, call);
        } else {
            // The load takes one component of the element: it becomes an access to the value that the call returns.
            f.expressions[element] = Expression::CallResult(call.function);
            f.expressions[load] = f.expressions[pointer].clone();
            calls.insert(element, call);
        }
    }
    if !calls.is_empty() {
        put_calls(&mut f.body, &mut f.expressions, &calls, signed);
    }
}

/// The expression in a chain of accesses that selects an element of an array with a reader, and the call that replaces
/// it.
fn element_of_array(
    expressions: &Arena<Expression>,
    pointer: Handle<Expression>,
    readers: &Readers,
) -> Option<(Handle<Expression>, Call)> {
    let (base, index) = match expressions[pointer] {
        Expression::Access { base, index } => (base, Index::Of(index)),
        Expression::AccessIndex { base, index } => (base, Index::Constant(index)),
        _ => return None,
    };
    match expressions[base] {
        Expression::GlobalVariable(g) => readers.get(&g).map(|&function| (pointer, Call { function, index })),
        _ => element_of_array(expressions, base, readers),
    }
}

/// Inserts the calls. A call is a statement, so it splits the range of expressions that were evaluated together where
/// the load was.
fn put_calls(
    block: &mut Block,
    expressions: &mut Arena<Expression>,
    calls: &HashMap<Handle<Expression>, Call>,
    signed: &dyn Fn(Handle<Expression>) -> bool,
) {
    for (mut statement, span) in std::mem::take(block).span_into_iter() {
        match &mut statement {
            Statement::Block(body) => put_calls(body, expressions, calls, signed),
            Statement::Loop { body, continuing, .. } => {
                put_calls(body, expressions, calls, signed);
                put_calls(continuing, expressions, calls, signed);
            }
            Statement::Switch { cases, .. } => {
                cases.iter_mut().for_each(|c| put_calls(&mut c.body, expressions, calls, signed));
            }
            Statement::If { accept, reject, .. } => {
                put_calls(accept, expressions, calls, signed);
                put_calls(reject, expressions, calls, signed);
            }
            Statement::Emit(range) => {
                let mut since: Option<Handle<Expression>> = None;
                let mut last = None;
                for h in range.clone() {
                    let Some(call) = calls.get(&h) else {
                        since = since.or(Some(h));
                        last = Some(h);
                        continue;
                    };
                    emit(block, since.take().zip(last), span);
                    let argument = match call.index {
                        Index::Constant(i) => expressions.append(Expression::Literal(Literal::U32(i)), span),
                        Index::Of(i) if signed(i) => {
                            let word = Expression::As { expr: i, kind: ScalarKind::Uint, convert: Some(4) };
                            let word = expressions.append(word, span);
                            emit(block, Some((word, word)), span);
                            word
                        }
                        Index::Of(i) => i,
                    };
                    let (function, arguments) = (call.function, vec![argument]);
                    block.push(Statement::Call { function, arguments, result: Some(h) }, span);
                }
                emit(block, since.zip(last), span);
                continue;
            }
            _ => {}
        }
        block.push(statement, span);
    }
}

fn emit(block: &mut Block, range: Option<(Handle<Expression>, Handle<Expression>)>, span: Span) {
    if let Some((first, last)) = range {
        block.push(Statement::Emit(Range::new_from_bounds(first, last)), span);
    }
}

#[cfg(test)]
mod tests {
    use super::super::specialise::specialised;
    use super::*;

    const TEXT: &str = "
@group(0) @binding(0) var<storage, read> list: array<u32>;
@group(0) @binding(1) var<storage, read> pairs: array<vec2<u32>>;
@group(0) @binding(2) var<storage, read> plain: array<u32>;
@group(0) @binding(3) var<storage, read_write> out: array<u32>;
fn twice(i: u32) -> u32 { return 2u * list[i]; }
@compute @workgroup_size(1)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let nested = list[plain[3] + list[id.x]];
    for (var i = 0; i < 4; i++) {
        out[id.x] += pairs[i].y + pairs[2].x + list[7];
    }
    let pair = pairs[twice(id.y)];
    out[nested] = pair.x + arrayLength(&plain);
}";

    #[test]
    fn loads_become_texels_and_nothing_else_does() {
        let readers: String = [("list", 0), ("pairs", 1)].map(|(n, k)| ELEMENTS[k].reader(n)).concat();
        let module = specialised(&(readers + TEXT), &[]);
        let mut validator = naga::valid::Validator::new(Default::default(), naga::valid::Capabilities::all());
        validator.validate(&module).unwrap();
        let bound = |name: &str| {
            let mut all = module.global_variables.iter();
            all.find(|(_, g)| g.name.as_deref() == Some(name)).map(|(_, g)| g.binding.unwrap().binding)
        };
        assert_eq!(["list_image", "pairs_image", "plain", "out"].map(bound), [0, 1, 2, 3].map(Some));
        assert_eq!(["list", "pairs"].map(bound), [None, None]);
        let body = format!("{:?}", module.entry_points[0].function.body);
        // `list` twice and once in the loop; `pairs` twice in the loop and once; and the call of `twice`, which calls a
        // reader.
        assert_eq!(body.matches("Call {").count(), 7, "{body}");
        // Without readers nothing changes.
        assert!(format!("{:?}", specialised(TEXT, &[]).entry_points[0].function.body).matches("Call {").count() == 1);
    }
}
