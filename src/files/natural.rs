//! In: file names. Out: a key that sorts them as people count: frame2 before frame10.
//! Frame and unit: none.

/// Text and numbers alternately; numbers compare by value, then by their leading zeros.
pub fn natural(name: &str) -> Vec<(String, u128, usize)> {
    let mut key = Vec::new();
    let mut rest = name;
    while !rest.is_empty() {
        let text = rest.find(|c: char| c.is_ascii_digit()).unwrap_or(rest.len());
        let digits = rest[text..].find(|c: char| !c.is_ascii_digit()).map_or(rest.len(), |n| text + n);
        let number = rest[text..digits].parse().unwrap_or(if digits > text { u128::MAX } else { 0 });
        key.push((rest[..text].to_owned(), number, digits - text));
        rest = &rest[digits..];
    }
    key
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_in_the_order_of_counting() {
        let mut names = ["frame10.png", "frame2.png", "a", "frame1.png", "frame02.png", "frame2b", "9", "10", "ä3"];
        names.sort_by_key(|n| natural(n));
        assert_eq!(names, ["9", "10", "a", "frame1.png", "frame2.png", "frame2b", "frame02.png", "frame10.png", "ä3"]);
        natural(&"9".repeat(500));
    }
}
