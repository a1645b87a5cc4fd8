//! In: a verdict, tables of numbers, plots. Out: a report of a calibration, and with feature `pages` one self-contained
//! HTML page of it.
//! Frame and unit: every number arrives as text with its unit.

#[cfg(feature = "pages")]
mod html;
mod plots;

pub use plots::{axis_sphere, bars, coverage_map, residual_arrows, scatter};

use crate::rig::Quality;

/// A report that is built from top to bottom.
///
/// ```
/// use sheetlight::calibrate::report::{Page, bars};
/// let mut page = Page::new("Camera calibration");
/// page.table("Figures", &["what", "value"], &[vec!["rms".into(), "0.05 px".into()]]);
/// page.figure("Residual per picture", &bars(&[("a.png".into(), 0.04)], "px", None));
/// # #[cfg(feature = "pages")]
/// assert!(page.html().contains("<svg"));
/// ```
pub struct Page {
    title: String,
    parts: Vec<Part>,
}

/// A part of a report. Texts are plain.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub enum Part {
    /// The verdict, its reasons and the next best picture.
    Verdict(Quality),
    /// Plain text.
    Paragraph(String),
    /// A table whose first column is text.
    Table {
        /// Its heading.
        title: String,
        /// Heads of the columns.
        head: Vec<String>,
        /// Rows of cells.
        rows: Vec<Vec<String>>,
    },
    /// A plot.
    Figure {
        /// What it shows.
        caption: String,
        /// An `<svg>` element.
        svg: String,
    },
}

impl Page {
    /// An empty report with this title.
    pub fn new(title: &str) -> Page {
        Page { title: title.into(), parts: Vec::new() }
    }
    /// Its title.
    pub fn title(&self) -> &str {
        &self.title
    }
    /// Its parts, from top to bottom.
    pub fn parts(&self) -> &[Part] {
        &self.parts
    }
    fn add(&mut self, part: Part) -> &mut Page {
        self.parts.push(part);
        self
    }
    /// The banner with the verdict, its reasons and the next best picture, in words.
    pub fn verdict(&mut self, quality: &Quality) -> &mut Page {
        self.add(Part::Verdict(quality.clone()))
    }
    /// Plain text.
    pub fn paragraph(&mut self, text: &str) -> &mut Page {
        self.add(Part::Paragraph(text.into()))
    }
    /// A table. The first column is text and aligned left; the others are aligned right.
    pub fn table(&mut self, title: &str, head: &[&str], rows: &[Vec<String>]) -> &mut Page {
        let head = head.iter().map(|cell| (*cell).into()).collect();
        self.add(Part::Table { title: title.into(), head, rows: rows.to_vec() })
    }
    /// A plot (an `<svg>` element) with its caption.
    pub fn figure(&mut self, caption: &str, svg: &str) -> &mut Page {
        self.add(Part::Figure { caption: caption.into(), svg: svg.into() })
    }
}
