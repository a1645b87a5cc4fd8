//! In: a verdict, tables of numbers, plots. Out: one self-contained HTML page for a person.
//! Frame and unit: every number arrives as text with its unit.

mod plots;

pub use plots::{axis_sphere, bars, coverage_map, residual_arrows, scatter};

use crate::fault::Result;
use crate::rig::{Quality, Verdict};
use maud::{DOCTYPE, Markup, PreEscaped, html};
use std::path::Path;

/// A report page that is built from top to bottom.
///
/// ```
/// use sheetlight::calibrate::report::{Page, bars};
/// let mut page = Page::new("Camera calibration");
/// page.table("Figures", &["what", "value"], &[vec!["rms".into(), "0.05 px".into()]]);
/// page.figure("Residual per picture", &bars(&[("a.png".into(), 0.04)], "px", None));
/// assert!(page.html().contains("<svg"));
/// ```
pub struct Page {
    title: String,
    parts: Vec<Markup>,
}

impl Page {
    /// An empty page with this title.
    pub fn new(title: &str) -> Page {
        Page { title: title.into(), parts: Vec::new() }
    }
    fn add(&mut self, part: Markup) -> &mut Page {
        self.parts.push(part);
        self
    }
    /// The banner with the verdict, its reasons and the next best picture, in words.
    pub fn verdict(&mut self, quality: &Quality) -> &mut Page {
        let class = match quality.verdict {
            Verdict::Good => "good",
            Verdict::Usable => "usable",
            Verdict::BadlyDetermined | Verdict::Refused => "bad",
        };
        let lists = [("Why:", &quality.reasons), ("Next best picture:", &quality.advice)];
        self.add(html! {
            section.verdict.(class) {
                h2 { (quality.verdict.words()) }
                @for (head, lines) in lists.iter().filter(|(_, lines)| !lines.is_empty()) {
                    p { (head) }
                    ul { @for line in *lines { li { (line) } } }
                }
            }
        })
    }
    /// Plain text.
    pub fn paragraph(&mut self, text: &str) -> &mut Page {
        self.add(html! { p { (text) } })
    }
    /// A table. The first column is text and aligned left; the others are aligned right.
    pub fn table(&mut self, title: &str, head: &[&str], rows: &[Vec<String>]) -> &mut Page {
        self.add(html! {
            h3 { (title) }
            table {
                tr { @for cell in head { th { (cell) } } }
                @for row in rows {
                    tr { @for cell in row { td { (cell) } } }
                }
            }
        })
    }
    /// A plot (an `<svg>` element) with its caption.
    pub fn figure(&mut self, caption: &str, svg: &str) -> &mut Page {
        self.add(html! { figure { (PreEscaped(svg)) figcaption { (caption) } } })
    }
    /// The complete page as text; it loads no other resource.
    pub fn html(&self) -> String {
        let page = html! {
            (DOCTYPE)
            html lang="en" {
                head { meta charset="utf-8"; title { (self.title) } style { (PreEscaped(STYLE)) } }
                body {
                    h1 { (self.title) }
                    @for part in &self.parts { (part) }
                    footer { "sheetlight " (env!("CARGO_PKG_VERSION")) }
                }
            }
        };
        page.into_string() + "\n"
    }
    /// Writes the page as one file.
    pub fn save(&self, path: &Path) -> Result<()> {
        crate::files::write(path, self.html().as_bytes())
    }
}

const STYLE: &str = include_str!("page.css");

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_stands_alone_and_cannot_be_broken_by_names() {
        let quality = Quality {
            verdict: Verdict::BadlyDetermined,
            reasons: vec!["all boards <parallel>".into()],
            advice: vec!["tilt it".into()],
            figures: Default::default(),
            per_picture: vec![],
        };
        let mut page = Page::new("A & B");
        page.verdict(&quality).table("T", &["a", "b"], &[vec!["<script>".into(), "1".into()]]);
        let html = page.html();
        assert!(html.contains("badly determined") && html.contains("&lt;parallel&gt;") && html.contains("A &amp; B"));
        assert!(!html.contains("<script") && !html.contains("http"));
    }
}
