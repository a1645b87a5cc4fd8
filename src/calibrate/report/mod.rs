//! In: a verdict, tables of numbers, plots. Out: one self-contained HTML page for a person.
//! Frame and unit: every number arrives as text with its unit.

mod plots;

pub use plots::{axis_sphere, bars, coverage_map, residual_arrows, scatter};

use crate::fault::Result;
use crate::rig::{Quality, Verdict};
use std::fmt::Write;
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
    body: String,
}

impl Page {
    /// Empty, under this title.
    pub fn new(title: &str) -> Page {
        Page { title: title.into(), body: String::new() }
    }
    /// The banner: verdict, reasons and the next best picture, in words.
    pub fn verdict(&mut self, quality: &Quality) -> &mut Page {
        let class = match quality.verdict {
            Verdict::Good => "good",
            Verdict::Usable => "usable",
            Verdict::BadlyDetermined | Verdict::Refused => "bad",
        };
        let _ = write!(self.body, "<section class=\"verdict {class}\"><h2>{}</h2>", escape(quality.verdict.words()));
        let list = |body: &mut String, head: &str, lines: &[String]| {
            if !lines.is_empty() {
                let items: String = lines.iter().map(|l| format!("<li>{}</li>", escape(l))).collect();
                let _ = write!(body, "<p>{head}</p><ul>{items}</ul>");
            }
        };
        list(&mut self.body, "Why:", &quality.reasons);
        list(&mut self.body, "Next best picture:", &quality.advice);
        self.body.push_str("</section>");
        self
    }
    /// Plain text; characters that HTML reads are escaped.
    pub fn paragraph(&mut self, text: &str) -> &mut Page {
        let _ = write!(self.body, "<p>{}</p>", escape(text));
        self
    }
    /// A table; the first column is text, the others are set to the right.
    pub fn table(&mut self, title: &str, head: &[&str], rows: &[Vec<String>]) -> &mut Page {
        let cells = |tag: &str, row: &mut dyn Iterator<Item = &str>| -> String {
            row.map(|c| format!("<{tag}>{}</{tag}>", escape(c))).collect()
        };
        let _ =
            write!(self.body, "<h3>{}</h3><table><tr>{}</tr>", escape(title), cells("th", &mut head.iter().copied()));
        for row in rows {
            let _ = write!(self.body, "<tr>{}</tr>", cells("td", &mut row.iter().map(String::as_str)));
        }
        self.body.push_str("</table>");
        self
    }
    /// A plot (an `<svg>` element) with its caption.
    pub fn figure(&mut self, caption: &str, svg: &str) -> &mut Page {
        let _ = write!(self.body, "<figure>{svg}<figcaption>{}</figcaption></figure>", escape(caption));
        self
    }
    /// The whole page; it loads nothing from anywhere.
    pub fn html(&self) -> String {
        let title = escape(&self.title);
        format!(
            "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\"><title>{title}</title><style>{STYLE}</style></head>\
             <body><h1>{title}</h1>{}<footer>sheetlight {}</footer></body></html>\n",
            self.body,
            env!("CARGO_PKG_VERSION")
        )
    }
    /// Writes the page as one file.
    pub fn save(&self, path: &Path) -> Result<()> {
        crate::files::write(path, self.html().as_bytes())
    }
}

const STYLE: &str = "body{font:15px/1.45 system-ui,sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem;color:#1c2733;background:#fff}\
h1{font-size:1.5rem}h2{margin:0;text-transform:uppercase;font-size:1.1rem}h3{margin:1.6rem 0 .4rem}\
.verdict{padding:1rem 1.2rem;border-radius:.5rem;border-left:.6rem solid}.good{background:#e7f5ea;border-color:#2c8a43}\
.usable{background:#fff5da;border-color:#c98a00}.bad{background:#fde8e6;border-color:#c0392b}\
table{border-collapse:collapse;font-variant-numeric:tabular-nums}td,th{padding:.2rem .8rem;border-bottom:1px solid #dde3e8;text-align:right}\
td:first-child,th:first-child{text-align:left}figure{margin:1.4rem 0}figcaption{color:#55636f;font-size:.9rem}\
svg{max-width:100%;height:auto;background:#fbfcfd;border:1px solid #dde3e8}footer{margin-top:3rem;color:#8895a1;font-size:.8rem}";

/// Text made safe inside HTML and SVG.
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

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
