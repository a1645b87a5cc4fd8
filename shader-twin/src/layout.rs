//! In: Rust types. Out: where their members lie, for the comparison with a WGSL type.

/// A member of a struct: bytes from the struct's begin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Field {
    /// Its name, which both sides share.
    pub name: &'static str,
    /// Where it begins, bytes.
    pub offset: usize,
    /// Size, bytes.
    pub bytes: usize,
}

/// A Rust type as a shader sees it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Layout {
    /// Name of the Rust type, for messages.
    pub name: &'static str,
    /// Size, bytes.
    pub bytes: usize,
    /// Members in the order of the WGSL struct. Empty for a number, a vector or a matrix.
    pub fields: Vec<Field>,
}

impl Layout {
    /// A number, a vector or a matrix: only its size is compared.
    pub fn of<T>() -> Layout {
        Layout { name: std::any::type_name::<T>(), bytes: size_of::<T>(), fields: Vec::new() }
    }

    /// The field that holds the word at this byte.
    pub(crate) fn field_at(&self, byte: usize) -> Option<&Field> {
        self.fields.iter().find(|f| (f.offset..f.offset + f.bytes).contains(&byte))
    }
}

/// The [`Layout`](crate::Layout) of a `#[repr(C)]` struct: its name and the members that WGSL has, in order.
///
/// Rust members that are only padding are not named. Words that no named member holds are not compared.
///
/// ```
/// #[repr(C)]
/// struct Params {
///     centre: [f32; 3],
///     count: u32,
///     scale: f32,
///     padding: [u32; 3],
/// }
/// let layout = shader_twin::layout!(Params { centre, count, scale });
/// assert_eq!((layout.bytes, layout.fields[1].offset), (32, 12));
/// ```
#[macro_export]
macro_rules! layout {
    ($name:ident { $($field:ident),+ $(,)? }) => {
        $crate::Layout {
            name: stringify!($name),
            bytes: ::core::mem::size_of::<$name>(),
            fields: vec![$($crate::Field {
                name: stringify!($field),
                offset: ::core::mem::offset_of!($name, $field),
                bytes: $crate::field_bytes(|all: &$name| &all.$field),
            }),+],
        }
    };
}

/// The size of what a closure takes from a struct; for [`layout!`](crate::layout!).
#[doc(hidden)]
pub const fn field_bytes<T, F>(_: fn(&T) -> &F) -> usize {
    size_of::<F>()
}

/// What a binding holds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Shape {
    /// One value.
    One(Layout),
    /// `array<T>`, as long as the buffer.
    Array(Layout),
    /// `array<T, N>`.
    Fixed(Layout, u32),
    /// A struct whose last member, of this name, is an `array<T>` as long as the rest of the buffer. The first layout
    /// is what lies before that member: its size is the member's offset.
    Tail(Layout, &'static str, Layout),
}

impl Shape {
    /// `array<T>` of numbers or vectors.
    pub fn array<T>() -> Shape {
        Shape::Array(Layout::of::<T>())
    }

    /// What a buffer of this many bytes lacks, if it does not fit.
    pub(crate) fn unfit(&self, bytes: usize) -> Option<String> {
        match self {
            Shape::One(l) => (bytes != l.bytes).then(|| format!("{} bytes of one {} are needed", l.bytes, l.name)),
            Shape::Fixed(l, n) => {
                let need = l.bytes * *n as usize;
                (bytes != need).then(|| format!("{need} bytes of {n} {} are needed", l.name))
            }
            Shape::Array(l) => (bytes == 0 || !bytes.is_multiple_of(l.bytes))
                .then(|| format!("one or more {} of {} bytes are needed", l.name, l.bytes)),
            Shape::Tail(head, name, l) => {
                let rest = bytes.checked_sub(head.bytes);
                rest.is_none_or(|r| r == 0 || !r.is_multiple_of(l.bytes)).then(|| {
                    format!(
                        "{} bytes and one or more {} of {} bytes in '{name}' are needed",
                        head.bytes, l.name, l.bytes
                    )
                })
            }
        }
    }

    /// The element that holds the word at this byte, and the byte within it. `None` before a tail.
    pub(crate) fn element_at(&self, byte: usize) -> (Option<usize>, usize, &Layout) {
        match self {
            Shape::One(l) => (None, byte, l),
            Shape::Array(l) | Shape::Fixed(l, _) => (Some(byte / l.bytes), byte % l.bytes, l),
            Shape::Tail(head, _, _) if byte < head.bytes => (None, byte, head),
            Shape::Tail(head, _, l) => {
                let byte = byte - head.bytes;
                (Some(byte / l.bytes), byte % l.bytes, l)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[repr(C)]
    struct Pair {
        count: u32,
        places: [f32; 2],
        padding: u32,
    }

    #[test]
    fn a_layout_has_the_offsets_and_sizes_of_the_rust_struct() {
        let layout = crate::layout!(Pair { count, places });
        let field = |name, offset, bytes| Field { name, offset, bytes };
        assert_eq!(layout.fields, [field("count", 0, 4), field("places", 4, 8)]);
        assert_eq!(layout.bytes, 16);
        assert_eq!(layout.field_at(11).unwrap().name, "places");
        assert!(layout.field_at(12).is_none());
        let pair = Pair { count: 1, places: [0.0; 2], padding: 0 };
        assert_eq!((pair.count, pair.places, pair.padding), (1, [0.0; 2], 0));
    }

    #[test]
    fn a_buffer_that_does_not_fit_is_refused() {
        let shapes = [
            (Shape::One(Layout::of::<u32>()), 4, 8),
            (Shape::array::<[u32; 2]>(), 16, 12),
            (Shape::array::<u32>(), 4, 0),
            (Shape::Fixed(Layout::of::<u32>(), 3), 12, 16),
            (Shape::Tail(Layout::of::<[u32; 2]>(), "rest", Layout::of::<[u32; 2]>()), 16, 8),
        ];
        for (shape, good, bad) in shapes {
            assert_eq!(shape.unfit(good), None);
            assert!(shape.unfit(bad).is_some(), "{shape:?}");
        }
    }

    #[test]
    fn a_word_is_found_in_its_element() {
        let tail = Shape::Tail(Layout::of::<[u32; 2]>(), "rest", Layout::of::<[u32; 3]>());
        assert_eq!((tail.element_at(4).0, tail.element_at(4).1), (None, 4));
        assert_eq!((tail.element_at(24).0, tail.element_at(24).1), (Some(1), 4));
    }
}
