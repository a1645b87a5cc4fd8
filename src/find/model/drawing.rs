//! In: a drawing (TOML): rectangles, circles, polygons, lines, arcs and grids of them, each on a surface.
//! Out: the same, checked, and the positions of its named shapes; drawn_edges.rs makes faces and edges of it.
//! Frame and unit: the part's frame (x along the long axis, z out of the part); mm.

use super::outline::length;
use super::shape::Shape;
use crate::fault::{Fault, Result};

/// A drawing: the shapes of a part.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Drawing {
    /// In the order of the file; part frame, mm.
    pub shape: Vec<Shape>,
}

/// Limits of a drawing. They keep the memory of a search below 512 MB and its time to some seconds; no sensor of this
/// kind sees a part of that size. Corners include those by which circles and arcs are cut into lines.
const MOST_CORNERS: f64 = 1.2e6;
const MOST_EDGE_MM: f64 = 1e5;
const MOST_HEIGHTS: f64 = 100.0;
const MOST_LENGTH_MM: f64 = 1e4;
const MOST_BOX_MM2: f64 = 4e6;

impl Drawing {
    /// Parses TOML and checks it.
    ///
    /// # Errors
    /// Text that is no drawing, and what [`Drawing::check`] refuses.
    pub fn parse(text: &str) -> Result<Drawing> {
        let drawing: Drawing = toml::from_str(text).map_err(|e| {
            Fault::input(format!("is not a drawing: {}", e.message()))
                .cause(crate::files::slip_at(
                    text,
                    e.span().map_or(0, |s| s.start),
                    "a misspelt key or a missing entry",
                ))
                .next("compare it with docs/file-formats.md, Drawing")
        })?;
        drawing.check()?;
        Ok(drawing)
    }

    /// Refuses shapes whose keys do not fit their kind and sizes that are not positive.
    pub fn check(&self) -> Result<()> {
        if self.shape.is_empty() {
            return Err(Fault::input("the drawing has no shapes").next("add at least one [[shape]]"));
        }
        for (i, s) in self.shape.iter().enumerate() {
            s.check().map_err(|e| e.at(format!("shape {}", i + 1)))?;
        }
        self.check_size()
    }

    /// Refuses sizes that no part has and no search can handle: a slipped decimal point, a whole assembly.
    fn check_size(&self) -> Result<()> {
        let corners: usize = self.shape.iter().map(|s| s.outline().0.len() * s.elements()).sum();
        let mut heights: Vec<f64> = self.shape.iter().map(|s| s.z_mm).collect();
        heights.sort_by(f64::total_cmp);
        heights.dedup();
        let limit = |what: &str, value: f64, most: f64| {
            if value <= most {
                return Ok(());
            }
            Err(Fault::input(format!("the drawing has {value:.0} {what}, limit {most:.0}"))
                .cause("a slipped decimal point, another unit, or more than one part")
                .next("correct the sizes, or draw only the outline that the scan shows"))
        };
        limit("corners", corners as f64, MOST_CORNERS)?;
        limit("mm of edges", self.edge_length(), MOST_EDGE_MM)?;
        limit("heights", heights.len() as f64, MOST_HEIGHTS)?;
        let [x0, y0, x1, y1] = self.bounds();
        limit("mm from end to end", (x1 - x0).max(y1 - y0), MOST_LENGTH_MM)?;
        limit("mm² in the box around it", (x1 - x0) * (y1 - y0), MOST_BOX_MM2)
    }

    /// Length of all edges, mm.
    pub fn edge_length(&self) -> f64 {
        let of = |s: &Shape| {
            let (points, closed) = s.outline();
            length(&points, closed) * s.elements() as f64
        };
        self.shape.iter().map(of).sum()
    }

    /// Nominal centre of `name` or `name[column,row]`, with the indices of its shape and element.
    pub fn named(&self, reference: &str) -> Result<(usize, usize, [f64; 2])> {
        let unknown = |why: String| {
            let names: Vec<&str> = self.shape.iter().filter_map(|s| s.name.as_deref()).collect();
            Fault::input(format!("'{reference}' names no shape: {why}"))
                .cause("a misspelt name, or an element outside its grid")
                .next(format!("named shapes are: {}", names.join(", ")))
        };
        let (name, element) = match reference.split_once('[') {
            None => (reference, None),
            Some((name, rest)) => {
                let numbers: Vec<u32> =
                    rest.trim_end_matches(']').split(',').filter_map(|n| n.trim().parse().ok()).collect();
                let [column, row] = numbers[..] else { return Err(unknown("wanted name[column,row]".into())) };
                (name, Some([column, row]))
            }
        };
        let found = self.shape.iter().position(|s| s.name.as_deref() == Some(name));
        let index = found.ok_or_else(|| unknown("no shape has that name".into()))?;
        let s = &self.shape[index];
        let count = s.grid.map_or([1, 1], |g| g.count);
        let [column, row] = element.unwrap_or([1, 1]);
        if element.is_none() && count != [1, 1] {
            return Err(unknown(format!("it is a grid of {} x {}, name an element", count[0], count[1])));
        }
        if column < 1 || row < 1 || column > count[0] || row > count[1] {
            return Err(unknown(format!("its grid has {} x {} elements", count[0], count[1])));
        }
        let element = ((row - 1) * count[0] + column - 1) as usize;
        Ok((index, element, self.centre_of(index, element)))
    }

    /// Nominal centre of an element of a shape.
    pub fn centre_of(&self, shape: usize, element: usize) -> [f64; 2] {
        let s = &self.shape[shape];
        let points = s.outline().0;
        let n = points.len() as f64;
        let own = s
            .centre
            .unwrap_or([points.iter().map(|p| p[0]).sum::<f64>() / n, points.iter().map(|p| p[1]).sum::<f64>() / n]);
        let Some(g) = s.grid else { return own };
        let at = [element as u32 % g.count[0], element as u32 / g.count[0]];
        std::array::from_fn(|k| own[k] + (f64::from(at[k]) - 0.5 * f64::from(g.count[k] - 1)) * g.pitch[k])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wrong_keys_are_refused() {
        for (text, word) in [
            ("[[shape]]\nkind = \"circle\"\ncentre = [0, 0]\n", "radius"),
            ("[[shape]]\nkind = \"circle\"\ncentre = [0, 0]\nradius = -1\n", "above 0"),
            ("[[shape]]\nkind = \"circle\"\ncentre = [0, 0]\nradius = 1\nsize = [1, 1]\n", "size"),
            ("[[shape]]\nkind = \"circle\"\ncentre = [0, 0]\nradius = 1\ncolour = 3\n", "colour"),
            ("[[shape]]\nkind = \"line\"\npoints = [[0, 0]]\n", "2 points"),
            ("shape = []", "no shapes"),
        ] {
            let e = Drawing::parse(text).unwrap_err();
            assert!(e.what.contains(word), "{text}: {}", e.what);
        }
    }
}
