//! Basis of all pages: the style sheet, markup as a type, data in a script.
//!
//! Markup is [`Html`], and only this file creates it from characters. The pages write with [`put!`] and [`html!`]. A
//! literal of the program is written unchanged. Each value in its braces is [written](Value) by its type: markup
//! unchanged, text escaped. No text can get into a page unescaped.

use core::fmt;

use serde_json::Value as Json;

/// Style of all pages: light or dark according to the reader's settings, and usable at the width of a telephone.
pub const STYLE: &str = include_str!("style.css");

/// The script that draws skeletons in space, a module. Its `Stage` rotates, zooms, and draws cameras, skeletons and
/// their uncertainty. The pages of runs contain the script; the live page loads it.
pub const STAGE: &str = include_str!("stage.js");

/// Markup, in which every text from outside is escaped.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Html(String);

impl Html {
    /// Wraps markup that is a constant of the program: a style sheet or a script.
    pub fn constant(markup: &'static str) -> Self {
        Self(markup.to_owned())
    }

    /// Wraps JSON so that it cannot end the `<script>` element that contains it.
    pub fn in_script(value: &Json) -> Self {
        Self(value.to_string().replace('<', "\\u003c"))
    }

    /// Appends formatted markup. Used only by [`put!`], which wraps every value.
    pub fn put_wrapped(&mut self, markup: fmt::Arguments<'_>) {
        // Writing to a string cannot fail.
        let _infallible = fmt::Write::write_fmt(&mut self.0, markup);
    }

    /// Returns true if nothing has been written.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Returns the finished page.
    pub fn into_page(self) -> String {
        self.0
    }
}

/// Adds to markup. The arguments are a literal, then in brackets the variables that are named in its braces, and then the other values.
///
/// `put!(out, "<text x=\"{x:.1}\">{}</text>", [x], name)`
#[macro_export]
macro_rules! put {
    ($out:expr, $markup:literal, [$($name:ident),+] $(, $value:expr)* $(,)?) => {
        // With `concat!`, braces cannot use variables that are not listed, which would otherwise be written without escaping.
        $out.put_wrapped(format_args!(
            concat!($markup)
            $(, $crate::report::html::Put(&$value))*
            $(, $name = $crate::report::html::Put(&$name))+
        ))
    };
    ($out:expr, $markup:literal $(, $value:expr)* $(,)?) => {
        $out.put_wrapped(format_args!(concat!($markup) $(, $crate::report::html::Put(&$value))*))
    };
}

/// Creates new markup, with the arguments of [`put!`].
#[macro_export]
macro_rules! html {
    ($($all:tt)+) => {{
        let mut html = $crate::report::html::Html::default();
        $crate::report::put!(html, $($all)+);
        html
    }};
}

pub(crate) use {html, put};

/// A value that may be used in the braces of [`put!`].
pub trait Value {
    /// Writes the value as markup.
    ///
    /// # Errors
    ///
    /// Fails if the output refuses the markup.
    fn write(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result;
}

/// A value in the braces of [`put!`].
pub struct Put<'a, T: ?Sized>(
    /// Value that is written.
    pub &'a T,
);

impl<T: Value + ?Sized> fmt::Display for Put<'_, T> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.write(out)
    }
}

impl Value for Html {
    fn write(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(&self.0)
    }
}

impl Value for str {
    /// Escapes the text for HTML, for XML and for attributes of both. Characters that XML does not allow become a question mark.
    fn write(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        use fmt::Write as _;

        for character in self.chars() {
            match character {
                '&' => out.write_str("&amp;")?,
                '<' => out.write_str("&lt;")?,
                '>' => out.write_str("&gt;")?,
                '"' => out.write_str("&quot;")?,
                '\'' => out.write_str("&#39;")?,
                '\n' | '\t' => out.write_char(character)?,
                '\u{fffe}' | '\u{ffff}' => out.write_char('?')?,
                control if control.is_control() => out.write_char('?')?,
                plain => out.write_char(plain)?,
            }
        }
        Ok(())
    }
}

impl Value for String {
    fn write(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.as_str().write(out)
    }
}

impl<T: Value + ?Sized> Value for &T {
    fn write(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        (**self).write(out)
    }
}

macro_rules! numbers {
    ($($number:ty),+) => {
        $(impl Value for $number {
            fn write(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
                fmt::Display::fmt(self, out)
            }
        })+
    };
}

numbers!(f64, i32, u8, u64, usize);

#[cfg(test)]
mod tests {
    use std::path::{Path, PathBuf};

    use proptest::prelude::*;
    use serde_json::json;

    use super::*;

    proptest! {
        #[test]
        fn text_cannot_break_out_of_its_element(text: String) {
            let value = json!({ "text": text });
            let script = Html::in_script(&value).into_page();
            prop_assert!(!script.contains('<'));
            prop_assert_eq!(serde_json::from_str::<Json>(&script).unwrap(), value);
            let escaped = html!("{}", text).into_page();
            prop_assert!(!escaped.contains(['<', '>', '"', '\'']));
        }
    }

    #[test]
    fn text_is_escaped_and_markup_is_not() {
        let text = html!("{}", "<a href=\"x\">&");
        assert_eq!(
            text.clone().into_page(),
            "&lt;a href=&quot;x&quot;&gt;&amp;"
        );
        let name = "<b>".to_owned();
        let number = 2.0 / 3.0;
        let all = html!(
            "<i>{}, {name}, {number:.2}</i>",
            [name, number],
            html!("<u>{}</u>", text)
        );
        assert_eq!(
            all.into_page(),
            "<i><u>&lt;a href=&quot;x&quot;&gt;&amp;</u>, &lt;b&gt;, 0.67</i>"
        );
    }

    #[test]
    fn pages_are_written_only_with_these_macros() {
        let pages = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/report");
        let mut folders: Vec<PathBuf> = vec![pages];
        let own = folders[0].join("html.rs");
        while let Some(folder) = folders.pop() {
            for entry in std::fs::read_dir(folder).unwrap() {
                let path = entry.unwrap().path();
                if path.is_dir() {
                    folders.push(path);
                } else if path != own && path.extension().is_some_and(|extension| extension == "rs")
                {
                    let text = std::fs::read_to_string(&path).unwrap();
                    for hatch in ["put_wrapped", "format_args!"] {
                        assert!(!text.contains(hatch), "{}: {hatch}", path.display());
                    }
                }
            }
        }
    }
}
