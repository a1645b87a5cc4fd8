//! In: the text of a table: one row per line; cells separated by a character or by white space, quoted or not;
//! comments after `#`. Out: its rows with their line numbers, and what comments state.
//! Frame and unit: none; cells are text.

/// A row of a table.
#[derive(Clone, Debug, PartialEq)]
pub struct TableRow {
    /// Line in the text, counted from 1.
    pub line: u64,
    /// The line without white space around it.
    pub text: String,
    /// The cells without white space and quotes around them.
    pub cells: Vec<String>,
}

/// The rows, of any length, in order. Empty lines and comments are skipped, and no row spans several lines.
/// `separator` is one ASCII character; a space stands for any white space. A byte order mark is ignored.
pub fn table(text: &str, separator: char) -> Vec<TableRow> {
    let lines = (1..).zip(text.trim_start_matches('\u{feff}').lines().map(str::trim));
    let rows = lines.filter(|(_, l)| !l.is_empty() && !l.starts_with('#'));
    rows.map(|(line, l)| TableRow { line, text: l.to_owned(), cells: cells(l, separator) }).collect()
}

/// The values that a table's comments state for any of these keys, which are in lower case: `# unit: mm`,
/// `# Unit = mm`.
pub fn stated<'a>(text: &'a str, keys: &[&str]) -> Vec<&'a str> {
    let lines = text.trim_start_matches('\u{feff}').lines().map(str::trim).filter(|l| l.starts_with('#'));
    let statements = lines.filter_map(|l| l.trim_start_matches('#').split_once([':', '=']));
    let of_key = statements.filter(|(key, _)| keys.contains(&key.trim().to_lowercase().as_str()));
    of_key.map(|(_, value)| value.trim()).collect()
}

fn cells(line: &str, separator: char) -> Vec<String> {
    if separator == ' ' {
        return line.split_whitespace().map(str::to_owned).collect();
    }
    // Making a reader takes 12 us, and poses are many lines.
    if !line.contains('"') {
        return line.split(separator).map(|cell| cell.trim().to_owned()).collect();
    }
    let mut reader = csv::ReaderBuilder::new();
    reader
        .has_headers(false)
        .flexible(true)
        .trim(csv::Trim::All)
        .delimiter(separator as u8)
        .buffer_capacity(line.len());
    // Reading text in memory cannot fail, and the cells stay valid UTF-8 because separators and quotes are ASCII.
    let record = reader.from_reader(line.as_bytes()).into_records().next().and_then(std::result::Result::ok);
    record.map_or_else(Vec::new, |r| r.iter().map(str::to_owned).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_state_values_wherever_they_stand() {
        let text = "\u{feff}# Unit = mm\n#made: today\na,b\n ## units:  \u{b5}m \r\n1,2\n# unit\n";
        assert_eq!(stated(text, &["unit", "units"]), ["mm", "\u{b5}m"]);
        assert!(stated("unit: mm\n", &["unit"]).is_empty());
    }

    #[test]
    fn cells_are_the_same_however_a_program_writes_them() {
        for (text, separator) in [
            ("\u{feff}# head\n\n  a, b c ,d\n# 1,2\n\n\"1\" ,2\n", ','),
            ("#\r\n\r\n\"a\";\"b c\";d\r\n  # b\r\n\r\n1;2", ';'),
            ("\n\na\tb c\td\n\n\n1\t2\n", '\t'),
        ] {
            let rows = table(text, separator);
            let is: Vec<_> = rows.iter().map(|r| (r.line, r.cells.join("|"))).collect();
            assert_eq!(is, [(3, "a|b c|d".to_owned()), (6, "1|2".to_owned())], "{text:?}");
        }
        assert_eq!(table("# x\n 1  2\t3\n", ' ')[0].cells, ["1", "2", "3"]);
        assert_eq!(table("a,\"1,5\"\n", ',')[0].cells, ["a", "1,5"]);
        let never_closed = table("\"never closed\n1,2,\n", ',');
        assert_eq!(never_closed[1].cells, ["1", "2", ""]);
        assert!(table("", ',').is_empty());
    }
}
