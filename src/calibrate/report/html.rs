//! In: a report. Out: one HTML page for a person; it loads no other resource.
//! Frame and unit: those of the report's texts.

use super::{Page, Part};
use crate::fault::Result;
use crate::rig::{Quality, Verdict};
use maud::{DOCTYPE, Markup, PreEscaped, html};
use std::path::Path;

const STYLE: &str = include_str!("page.css");

impl Page {
    /// The complete page as text.
    pub fn html(&self) -> String {
        let page = html! {
            (DOCTYPE)
            html lang="en" {
                head { meta charset="utf-8"; title { (self.title) } style { (PreEscaped(STYLE)) } }
                body {
                    h1 { (self.title) }
                    @for part in &self.parts { (markup(part)) }
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

fn markup(part: &Part) -> Markup {
    match part {
        Part::Verdict(quality) => verdict(quality),
        Part::Paragraph(text) => html! { p { (text) } },
        Part::Table { title, head, rows } => html! {
            h3 { (title) }
            table {
                tr { @for cell in head { th { (cell) } } }
                @for row in rows {
                    tr { @for cell in row { td { (cell) } } }
                }
            }
        },
        Part::Figure { caption, svg } => html! { figure { (PreEscaped(svg)) figcaption { (caption) } } },
    }
}

fn verdict(quality: &Quality) -> Markup {
    let class = match quality.verdict {
        Verdict::Good => "good",
        Verdict::Usable => "usable",
        Verdict::BadlyDetermined | Verdict::Refused => "bad",
    };
    let lists = [("Why:", &quality.reasons), ("Next best picture:", &quality.advice)];
    html! {
        section.verdict.(class) {
            h2 { (quality.verdict.words()) }
            @for (head, lines) in lists.iter().filter(|(_, lines)| !lines.is_empty()) {
                p { (head) }
                ul { @for line in *lines { li { (line) } } }
            }
        }
    }
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
