//! A page of one file: escaped text, formatted numbers, embedded pictures.

use std::fmt::Write;

/// Seconds below which a duration is in seconds; longer ones are in minutes.
const TEN_MINUTES: f64 = 600.0;

/// Seconds below which a duration is in milliseconds.
const SECOND: f64 = 0.9995;

/// Seconds below which a duration is in microseconds, with at most three digits.
const MILLISECOND: f64 = 0.9995e-3;

/// A row of a list of pairs or searches.
#[derive(Clone, PartialEq, Debug)]
pub struct Remark {
    /// Its subject, such as `12 and 40`.
    pub about: String,
    /// The explanation.
    pub text: String,
}

/// Escapes text for an element or a quoted attribute.
pub fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            // HTML forbids the other control characters.
            c if c.is_control() && !matches!(c, '\n' | '\t') => out.push('\u{fffd}'),
            c => out.push(c),
        }
    }
    out
}

/// A whole number with commas between thousands.
pub fn thousands(n: u64) -> String {
    let digits = n.to_string();
    let mut out = String::with_capacity(digits.len() * 4 / 3);
    for (i, c) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            out.push(',');
        }
        out.push(c);
    }
    out
}

/// A formatted number, with the plain one for programs beside it.
pub fn number(n: u64) -> String {
    format!("<data value=\"{n}\">{}</data>", thousands(n))
}

/// A share in percent, with enough digits to tell it from 0 and from 100.
pub fn percent(part: u64, whole: u64) -> String {
    let share = 100.0 * part as f64 / whole.max(1) as f64;
    let rest = share.min(100.0 - share);
    let digits = if rest == 0.0 || rest >= 1.0 { 1 } else { (1.0 - rest.log10()).ceil().min(6.0) as usize };
    format!("{share:.digits$} %")
}

/// A share in percent, two digits.
pub fn share(part: f64) -> String {
    let percent = 100.0 * part;
    if !(percent > 0.0 && percent.is_finite()) {
        return "0 %".to_owned();
    }
    let digits = (1.0 - percent.log10().floor()).clamp(0.0, 9.0) as usize;
    let text = format!("{percent:.digits$}");
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    format!("{text} %")
}

/// A time with its unit, three digits.
pub fn duration(seconds: f64) -> String {
    match seconds {
        s if s < MILLISECOND => format!("{:.0} µs", s * 1e6),
        s if s < SECOND => format!("{} ms", three_digits(s * 1e3)),
        s if s < TEN_MINUTES => format!("{} s", three_digits(s)),
        s => format!("{:.0} min", s / 60.0),
    }
}

fn three_digits(x: f64) -> String {
    let digits = (2.0 - x.max(1.0).log10().floor()).max(0.0) as usize;
    format!("{x:.digits$}")
}

/// A folded section of a page: the title is visible, `body` (already escaped) opens on a click.
pub fn folded(title: &str, body: &str) -> String {
    format!("<details class=\"part\">\n<summary>{title}</summary>\n{body}</details>\n")
}

/// A table of descriptions, plain text, with their numbers of pairs.
pub fn counts_table(out: &mut String, counts: &[(String, u64)]) {
    out.push_str("<div class=\"scroll\"><table><thead><tr><th>what</th><th>pairs</th></tr></thead>\n<tbody>\n");
    for (what, pairs) in counts {
        let _ = writeln!(out, "<tr><td>{}</td><td>{}</td></tr>", escape(what), number(*pairs));
    }
    out.push_str("</tbody></table></div>\n");
}

/// A PNG as a data URL.
pub fn png_address(png: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut out = String::from("data:image/png;base64,");
    for three in png.chunks(3) {
        let word = (0..3).fold(0u32, |w, i| w << 8 | u32::from(three.get(i).copied().unwrap_or(0)));
        for i in 0..4 {
            let digit = DIGITS[(word >> (18 - 6 * i)) as usize & 63];
            out.push(if i <= three.len() { char::from(digit) } else { '=' });
        }
    }
    out
}

/// Style of every page: light or dark as the reader prefers, for narrow screens and print.
const STYLE: &str = "
:root{color-scheme:light dark;--page:#fbfaf8;--card:#fff;--ink:#1c1d20;--soft:#5d6068;--rule:#dcdad5;--lower:#1f66d0;--upper:#c2460b;
--other:#7a3fc4;--lines:#0d7a5f;--band:#c2460b1f;
--s0:#1f66d0;--s1:#c2460b;--s2:#0d7a5f;--s3:#7a3fc4;--s4:#a6761d;--s5:#b0307a;--s6:#4a5560;
--t0:#cfe0f3;--t1:#f6dfc4;--t2:#d3ead2;--t3:#ecd5e6;--t4:#f4ecbb;--t5:#cfe9e8;--t6:#e3dcf3;
--door:#c2460b;--window:#1f7fd6;--opening:#2a8f52;--wall:#33363d;--thing:#8b8e96}
@media(prefers-color-scheme:dark){:root{--page:#15171b;--card:#1d2026;--ink:#e8e8ea;--soft:#a3a7b0;--rule:#383c45;--lower:#6fb0ff;
--upper:#ff9a5c;--other:#c79bff;--lines:#4fd0a6;--band:#ff9a5c26;
--s0:#6fb0ff;--s1:#ff9a5c;--s2:#4fd0a6;--s3:#c79bff;--s4:#e0b75c;--s5:#ff8fc7;--s6:#aab4c0;
--t0:#2b3e57;--t1:#54422f;--t2:#2f4a37;--t3:#4c3549;--t4:#4d4829;--t5:#2a4849;--t6:#3d3858;
--door:#ff9a5c;--window:#6fb8ff;--opening:#63cf8b;--wall:#c9ccd3;--thing:#737782}}
*{box-sizing:border-box}
body{margin:0 auto;max-width:62rem;padding:1.5rem 1.25rem 4rem;background:var(--page);color:var(--ink);
font:16px/1.5 system-ui,-apple-system,'Segoe UI','DejaVu Sans',sans-serif}
h1{font-size:1.7rem;line-height:1.2;margin:.5rem 0;overflow-wrap:anywhere}
h2{font-size:1.2rem;margin:2.4rem 0 .4rem}
p{margin:.5rem 0;max-width:46rem}
.part{border-top:1px solid var(--rule);padding:.5rem 0}.part>summary{font-size:1.1rem;font-weight:600;cursor:pointer}
.soft,figcaption,caption{color:var(--soft);font-size:.9rem}
.tiles{display:grid;grid-template-columns:repeat(auto-fit,minmax(11rem,1fr));gap:.75rem;margin:1.2rem 0}
.tiles.wide{grid-template-columns:repeat(auto-fit,minmax(13.5rem,1fr))}
.tiles div{background:var(--card);border:1px solid var(--rule);border-radius:.5rem;padding:.7rem .9rem}
.tiles b{display:block;font-size:1.35rem;font-variant-numeric:tabular-nums}
figure{margin:1rem 0;background:var(--card);border:1px solid var(--rule);border-radius:.5rem;padding:.9rem}
figure svg[role=img]{display:block;width:100%;height:auto}
.legend{display:flex;flex-wrap:wrap;gap:.2rem 1.4rem;margin:0 0 .5rem;padding:0;list-style:none;font-size:.9rem}
.legend svg{width:2rem;height:.8rem;margin-right:.4rem;vertical-align:middle}
.scroll{overflow-x:auto}
table{border-collapse:collapse;font-variant-numeric:tabular-nums;font-size:.92rem}
caption{text-align:left;padding:.2rem 0}
th,td{padding:.25rem .9rem .25rem 0;text-align:right;border-bottom:1px solid var(--rule);white-space:nowrap}
th{font-weight:600;vertical-align:bottom}
th:first-child,td:first-child,.text{text-align:left}
td.text{white-space:normal}
code{font:.9em ui-monospace,'DejaVu Sans Mono',monospace;overflow-wrap:anywhere}
.matrix{display:block;max-width:100%;height:auto;border:1px solid var(--rule);background:var(--page);image-rendering:pixelated}
.axis{stroke:var(--soft);stroke-width:1;fill:none}.grid{stroke:var(--rule);stroke-width:1}
svg text{fill:var(--soft);font-size:13px}
.lower{stroke:var(--lower)}.upper{stroke:var(--upper)}.other{stroke:var(--other);stroke-dasharray:9 5}
.lines{stroke:var(--lines);stroke-dasharray:2 4}
.s0{stroke:var(--s0)}.s1{stroke:var(--s1)}.s2{stroke:var(--s2)}.s3{stroke:var(--s3)}.s4{stroke:var(--s4)}.s5{stroke:var(--s5)}.s6{stroke:var(--s6)}
.dashed{stroke-dasharray:7 4}
.cell{stroke:none}.t0{fill:var(--t0)}.t1{fill:var(--t1)}.t2{fill:var(--t2)}.t3{fill:var(--t3)}.t4{fill:var(--t4)}.t5{fill:var(--t5)}.t6{fill:var(--t6)}
.cell:hover{stroke:var(--ink);stroke-width:1.5}
.wall,.thing,.portal{fill:none;pointer-events:none}
.wall{stroke:var(--wall);stroke-width:1.1;stroke-linecap:round}.thing{stroke:var(--thing);stroke-width:.6;opacity:.7}
.portal{stroke-width:3.2}.lying{stroke-width:1.3;stroke-dasharray:5 4}
.door{stroke:var(--door)}.window{stroke:var(--window)}.opening{stroke:var(--opening)}
.plan .name{fill:var(--ink);font-weight:600;text-anchor:middle;pointer-events:none}
.plan .id{fill:var(--ink);font-size:8px;text-anchor:middle;pointer-events:none;paint-order:stroke;stroke:var(--card);stroke-width:2.5px}
.curve{fill:none;stroke-width:2.2;stroke-linejoin:round}.band{fill:var(--band);stroke:none}
.dot{stroke-width:1.6;stroke-dasharray:none;fill:var(--card)}
.key{display:inline-block;width:.8em;height:.8em;border:1px solid var(--rule);margin-right:.35em;vertical-align:-.05em}
@media(max-width:40rem){figure .scroll>svg{min-width:34rem}}
@media print{figure,.tiles div{break-inside:avoid}}
";

/// A page. `title` is plain text; `body` is already escaped. Nothing is loaded from elsewhere, and scripts cannot run.
pub fn page(title: &str, body: &str) -> String {
    let (title, version) = (escape(title), env!("CARGO_PKG_VERSION"));
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'; img-src data:\">\n\
         <meta name=\"generator\" content=\"enfilade {version}\">\n\
         <title>{title}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n{body}</body>\n</html>\n"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_can_do_no_harm() {
        assert_eq!(escape("<a href=\"x\">'&'\u{7}\n"), "&lt;a href=&quot;x&quot;&gt;&#39;&amp;&#39;\u{fffd}\n");
        assert!(page("</title><script>", "").contains("<title>&lt;/title&gt;&lt;script&gt;</title>"));
    }

    #[test]
    fn numbers_as_people_write_them() {
        assert_eq!([0, 999, 1000, 1_234_567].map(thousands), ["0", "999", "1,000", "1,234,567"]);
        assert_eq!(
            [12e-6, 1e-3, 0.0456, 0.9999, 12.34, 3600.0].map(duration),
            ["12 µs", "1.00 ms", "45.6 ms", "1.00 s", "12.3 s", "60 min"]
        );
        assert_eq!(
            [(0, 7), (1, 2), (3, 1_000_000), (7, 7), (9995, 10_000)].map(|(a, b)| percent(a, b)),
            ["0.0 %", "50.0 %", "0.00030 %", "100.0 %", "99.950 %"]
        );
    }

    #[test]
    fn shares_have_two_digits() {
        assert_eq!(
            [0.0, 1e-6, 0.001_234, 0.01, 0.128, 1.0].map(share),
            ["0 %", "0.0001 %", "0.12 %", "1 %", "13 %", "100 %"]
        );
    }

    #[test]
    fn base64_is_the_standards() {
        // RFC 4648, section 10.
        for (bytes, text) in
            [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foob", "Zm9vYg=="), ("fooba", "Zm9vYmE=")]
        {
            assert_eq!(png_address(bytes.as_bytes()), format!("data:image/png;base64,{text}"));
        }
    }
}
