//! In: counters and figures with their labels. Out: the text that Prometheus reads (exposition format 0.0.4).
//! Frame and unit: as the names say; Prometheus wants base units (seconds, bytes).

use std::fmt::{Display, Write};

/// Media type of the text.
pub const MEDIA: &str = "text/plain; version=0.0.4; charset=utf-8";

/// Families of figures, one after the other.
#[derive(Debug, Default)]
pub struct Metrics(String);

impl Metrics {
    /// A family: its name, `counter` or `gauge`, what it is, and each figure with its labels. A family without figures
    /// is not written.
    pub fn family<'a, N: Display>(
        &mut self,
        (name, kind): (&str, &str),
        help: &str,
        figures: impl IntoIterator<Item = (Vec<(&'a str, &'a str)>, N)>,
    ) {
        let mut figures = figures.into_iter().peekable();
        if figures.peek().is_none() {
            return;
        }
        let _ = writeln!(self.0, "# HELP {name} {help}\n# TYPE {name} {kind}");
        for (labels, figure) in figures {
            let labels: Vec<String> = labels.iter().map(|(l, v)| format!("{l}=\"{}\"", escaped(v))).collect();
            let labels = if labels.is_empty() { String::new() } else { format!("{{{}}}", labels.join(",")) };
            let _ = writeln!(self.0, "{name}{labels} {figure}");
        }
    }
    /// A family of one figure without labels; nothing where the figure is unknown.
    pub fn one<N: Display>(&mut self, named: (&str, &str), help: &str, figure: Option<N>) {
        self.family(named, help, figure.map(|f| (Vec::new(), f)));
    }
    /// All that was written.
    pub fn text(self) -> String {
        self.0
    }
}

/// A label's value between quotes.
fn escaped(value: &str) -> String {
    value.replace('\\', "\\\\").replace('"', "\\\"").replace('\n', "\\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_label_keeps_quotes_backslashes_and_line_ends() {
        let mut m = Metrics::default();
        m.family(("a_total", "counter"), "Of a.", [(vec![("name", "x\"\\\ny"), ("b", "c")], 3)]);
        m.one(("b", "gauge"), "Of b.", None::<f64>);
        m.one(("c", "gauge"), "Of c.", Some(0.5));
        let want = "# HELP a_total Of a.\n# TYPE a_total counter\na_total{name=\"x\\\"\\\\\\ny\",b=\"c\"} 3\n\
                    # HELP c Of c.\n# TYPE c gauge\nc 0.5\n";
        assert_eq!(m.text(), want);
    }
}
