//! In: pictures, bytes, counts. Out: content embedded in a page instead of loaded by it.
//! Frame and unit: none.

use crate::fault::Result;
use base64::prelude::{BASE64_STANDARD, Engine};
use maud::{Markup, PreEscaped, html};
use std::path::Path;

/// Most bytes of a picture on the page.
const MOST_PICTURE: u64 = 256 << 20;

/// Bytes as base64 text, for a page or a JSON file.
pub fn base64(bytes: &[u8]) -> String {
    BASE64_STANDARD.encode(bytes)
}

/// A picture embedded in the page.
pub(super) fn picture(folder: &Path, name: &str, caption: &str) -> Result<Markup> {
    let bytes = crate::files::read(&folder.join(name), MOST_PICTURE)?;
    Ok(html! {
        figure {
            img alt=(caption) src=(PreEscaped(format!("data:image/png;base64,{}", base64(&bytes))));
            figcaption { (caption) }
        }
    })
}

/// A count with a comma at every third digit.
pub(super) fn thousands(n: u64) -> String {
    let digits = n.to_string();
    let mut out = String::new();
    for (i, c) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            out.push(',');
        }
        out.push(c);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_counts_are_read_in_threes() {
        assert_eq!(thousands(1_234_567), "1,234,567");
        assert_eq!(thousands(999), "999");
    }
}
