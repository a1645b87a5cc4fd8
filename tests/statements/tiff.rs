//! Puts TIFF files together byte by byte: any tags, either byte order, BigTIFF, several pages.

/// A page: tags with their type and bytes in little-endian order, and one strip of samples.
#[derive(Clone, Default)]
pub struct Page {
    tags: Vec<(u16, u16, Vec<u8>)>,
    data: Vec<u8>,
    /// Bytes of a sample, for the other byte order.
    sample: usize,
    /// Strips of equal length that the samples are stored in; more than one where channels are planes.
    strips: usize,
}

const SHORT: u16 = 3;

fn bytes_of(kind: u16) -> usize {
    [0, 1, 1, 2, 4, 8, 1, 1, 2, 4, 8, 4, 8][kind as usize]
}

impl Page {
    /// Grey samples of `bits` and `format` (1 whole, 2 with a sign, 3 floating point), given as little-endian bytes.
    pub fn grey([width, height]: [u16; 2], bits: u16, format: u16, data: Vec<u8>) -> Page {
        let page = Page { tags: vec![], data, sample: usize::from(bits).div_ceil(8), strips: 1 };
        let page = page.short(256, width).short(257, height).short(258, bits).short(259, 1).short(262, 1);
        page.short(277, 1).short(278, height).short(339, format)
    }

    /// A page of 32-bit floats.
    pub fn floats(size: [u16; 2], values: &[f32]) -> Page {
        Page::grey(size, 32, 3, values.iter().flat_map(|v| v.to_le_bytes()).collect())
    }

    /// Channels one after another (PlanarConfiguration 2), so many of them.
    pub fn planes(self, strips: usize) -> Page {
        Page { strips, ..self }.short(284, 2)
    }

    pub fn with(mut self, tag: u16, kind: u16, value: Vec<u8>) -> Page {
        self.tags.retain(|t| t.0 != tag);
        self.tags.push((tag, kind, value));
        self
    }

    pub fn short(self, tag: u16, value: u16) -> Page {
        self.with(tag, SHORT, value.to_le_bytes().to_vec())
    }

    pub fn shorts(self, tag: u16, values: &[u16]) -> Page {
        self.with(tag, SHORT, values.iter().flat_map(|v| v.to_le_bytes()).collect())
    }

    pub fn text(self, tag: u16, text: &str) -> Page {
        self.with(tag, 2, [text.as_bytes(), b"\0"].concat())
    }

    pub fn doubles(self, tag: u16, values: &[f64]) -> Page {
        self.with(tag, 12, values.iter().flat_map(|v| v.to_le_bytes()).collect())
    }
}

/// The file; `big` makes a BigTIFF, `swapped` the byte order of Motorola.
pub fn tiff(pages: &[Page], big: bool, swapped: bool) -> Vec<u8> {
    let turned = |bytes: &[u8], size: usize| -> Vec<u8> {
        if swapped { bytes.chunks(size).flat_map(|c| c.iter().rev().copied()).collect() } else { bytes.to_vec() }
    };
    let number = |v: u64, size: usize| turned(&v.to_le_bytes()[..size], size);
    let wide = if big { 8 } else { 4 };
    let mut out = if swapped { b"MM".to_vec() } else { b"II".to_vec() };
    out.extend(number(if big { 43 } else { 42 }, 2));
    if big {
        out.extend([number(8, 2), number(0, 2)].concat());
    }
    let mut link = out.len();
    out.extend(number(0, wide));
    for page in pages {
        let mut tags = page.tags.clone();
        let strip = out.len() as u64;
        out.extend(turned(&page.data, page.sample.max(1)));
        let each = (page.data.len() / page.strips) as u32;
        tags.push((273, 4, (0..page.strips as u32).flat_map(|k| (strip as u32 + k * each).to_le_bytes()).collect()));
        tags.push((279, 4, each.to_le_bytes().repeat(page.strips)));
        tags.sort_by_key(|t| t.0);
        let mut entries = Vec::new();
        for (tag, kind, value) in &tags {
            let size = bytes_of(*kind);
            let mut field = turned(value, size);
            if field.len() > wide {
                let at = out.len() as u64;
                out.extend(&field);
                field = number(at, wide);
            }
            field.resize(wide, 0);
            entries.extend([number((*tag).into(), 2), number((*kind).into(), 2)].concat());
            entries.extend(number((value.len() / size) as u64, wide));
            entries.extend(field);
        }
        let here = out.len() as u64;
        out.splice(link..link + wide, number(here, wide));
        out.extend(number(tags.len() as u64, if big { 8 } else { 2 }));
        out.extend(entries);
        link = out.len();
        out.extend(number(0, wide));
    }
    out
}
