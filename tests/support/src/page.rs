//! What every page keeps.

/// Every element is closed in order, every `<` begins one, and nothing is loaded or run.
pub fn check_page(html: &str) {
    let mut open: Vec<&str> = Vec::new();
    let body = html.strip_prefix("<!DOCTYPE html>").expect("a doctype");
    let mut rest = body;
    while let Some(at) = rest.find('<') {
        assert!(!rest[..at].contains('>') || open.last() == Some(&"style"), "a stray > before {}", &rest[at..at + 40]);
        let end = at + rest[at..].find('>').expect("a tag that ends");
        let tag = &rest[at + 1..end];
        assert_eq!(tag.matches('"').count() % 2, 0, "{tag}");
        let name = tag.trim_start_matches('/').split([' ', '/']).next().unwrap();
        if tag.starts_with('/') {
            assert_eq!(open.pop(), Some(name));
        } else if !tag.ends_with('/') && !["meta", "img"].contains(&name) {
            assert!(name.chars().all(|c| c.is_ascii_alphanumeric()), "{tag}");
            open.push(name);
        }
        assert!(!["script", "link", "iframe", "object"].contains(&name), "{tag}");
        assert!(!tag.contains("://") && !tag.contains("href") && !tag.contains(" on"), "{tag}");
        rest = &rest[end + 1..];
    }
    assert!(open.is_empty(), "{open:?}");
    assert!(html.contains("default-src 'none'") && !html.contains("url("), "nothing is loaded");
    // In the letters of a picture there may be anything.
    let words =
        html.split("base64,").enumerate().map(|(i, part)| if i == 0 { part } else { &part[part.find('"').unwrap()..] });
    assert!(html.contains("prefers-color-scheme:dark") && !words.collect::<String>().contains("NaN"));
}
