//! Fenced blocks of a Markdown file.

/// A fenced block.
#[derive(Debug)]
pub(crate) struct Block {
    /// Line of the first fence, counted from 1.
    pub(crate) line: usize,
    /// Words of the info string: the language, then marks.
    pub(crate) info: Vec<String>,
    /// Text between the fences.
    pub(crate) text: String,
}

impl Block {
    /// Returns true if the block has a language and a mark.
    pub(crate) fn is(&self, language: &str, mark: &str) -> bool {
        self.info.first().is_some_and(|info| info == language)
            && self.info.iter().any(|word| word == mark)
    }
}

/// Returns all fenced blocks of a text.
pub(crate) fn blocks(text: &str) -> Vec<Block> {
    let mut found: Vec<Block> = Vec::new();
    let mut is_open = false;
    for (nth, line) in text.lines().enumerate() {
        match line.trim_start().strip_prefix("```") {
            Some(_) if is_open => is_open = false,
            Some(info) => {
                is_open = true;
                found.push(Block {
                    line: nth + 1,
                    info: info.split_whitespace().map(str::to_owned).collect(),
                    text: String::new(),
                });
            }
            None => {
                if let Some(block) = found.last_mut().filter(|_| is_open) {
                    block.text.push_str(line);
                    block.text.push('\n');
                }
            }
        }
    }
    found
}

/// Returns a text in which the lines of fenced blocks are empty.
pub(crate) fn prose(text: &str) -> String {
    let mut is_open = false;
    let mut prose = String::new();
    for line in text.lines() {
        let is_fence = line.trim_start().starts_with("```");
        if !is_open && !is_fence {
            prose.push_str(line);
        }
        prose.push('\n');
        is_open ^= is_fence;
    }
    prose
}
