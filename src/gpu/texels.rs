//! In: WGSL that reads arrays of words. Out: the same WGSL reading the same words as texels of an image.
//! Frame and unit: words of 32 bits, alone or in vectors of 2 or 4.
//!
//! Mesa's software adapter reads a storage buffer one lane after the other, in a loop with a branch; a texel it gathers for
//! all lanes at once. Stores are the other way round. So stages write buffers, and read them as images that lie on the
//! same memory ([`super::alias`]); decision 0012 says how to measure it.

use super::description::{Access, Stage};

/// Texels a row of such an image, as a power of two: what lies behind each other in the buffer fills row after row.
/// 16,384 rows, what every adapter has, of single words are 256 MiB.
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

/// An array's element in WGSL, and the texels it is read as: two words a texel take the adapter longer than two
/// texels of one.
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
    /// A function that reads element `i`.
    fn reader(self, name: &str) -> String {
        let (mask, shift) = ((1 << ROW_LOG2) - 1, ROW_LOG2);
        let load = |index: &str| format!("textureLoad({name}, vec2(({index}) & {mask}u, ({index}) >> {shift}u))");
        let value = match self.ty {
            "u32" => format!("{}.x", load("i")),
            "vec2<u32>" => format!("vec2({}.x, {}.x)", load("2u * i"), load("2u * i + 1u")),
            _ => load("i"),
        };
        format!("\nfn {name}_texel(i: u32) -> {} {{\n    return {value};\n}}\n", self.ty)
    }
}

/// The element of a binding's array; panics where a stage promises texels of what has none.
fn element_of(stage: &Stage, binding: &str) -> Element {
    let found = ELEMENTS.into_iter().find(|e| stage.wgsl.contains(&e.declaration(binding)));
    found.unwrap_or_else(|| panic!("{}: '{binding}' is no read-only array of u32, vec2<u32> or vec4<u32>", stage.name))
}

/// What a binding's texels are.
pub(super) fn texel_of(stage: &Stage, binding: &str) -> Texel {
    element_of(stage, binding).texel
}

/// The stage's text with its `Access::Texels` bindings as images.
pub(super) fn rewrite(stage: &Stage, source: &str) -> String {
    let mut text = source.to_string();
    for b in stage.bindings.iter().filter(|b| b.access == Access::Texels) {
        let (name, element) = (b.name, element_of(stage, b.name));
        let image = format!("var {name}: texture_storage_2d<{}, read>;", element.texel.wgsl());
        text = reads(&text.replace(&element.declaration(name), &image), name);
        text += &element.reader(name);
    }
    text
}

/// Every `name[index]` as `name_texel(u32(index))`.
fn reads(text: &str, name: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(at) = rest.find(name) {
        let (before, from) = rest.split_at(at);
        let inside_word = before.ends_with(|c: char| c.is_alphanumeric() || c == '_' || c == '.');
        out += before;
        match from[name.len()..].strip_prefix('[') {
            Some(index) if !inside_word => {
                let end = closing(index);
                out += &format!("{name}_texel(u32({}))", reads(&index[..end], name));
                rest = &index[end + 1..];
            }
            _ => {
                out += name;
                rest = &from[name.len()..];
            }
        }
    }
    out + rest
}

/// Where the bracket that was just opened closes.
fn closing(text: &str) -> usize {
    let mut depth = 0;
    for (at, c) in text.char_indices() {
        match c {
            '[' => depth += 1,
            ']' if depth == 0 => return at,
            ']' => depth -= 1,
            _ => {}
        }
    }
    panic!("a bracket is not closed: {text}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_become_texels_and_nothing_else_does() {
        let text = "let a = list[listing[3] + list[i]] + my_list[2] + o.list[1] + lists[4] + list_index;";
        let wanted = "let a = list_texel(u32(listing[3] + list_texel(u32(i)))) + my_list[2] + o.list[1] + lists[4] + list_index;";
        assert_eq!(reads(text, "list"), wanted);
    }
}
