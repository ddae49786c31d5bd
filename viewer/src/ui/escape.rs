//! What Escape does: it takes back one thing at a time, and quits when there is nothing left.

/// Panels that Escape closes, the one that is closed first first.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Panel {
    /// Whether to quit.
    Question,
    /// The list of keys.
    Keys,
    /// The window to find things in.
    Find,
    /// The settings.
    Preferences,
    /// The profile of a path.
    Profile,
    /// Why one sees the other.
    Why,
    /// Lengths.
    Measure,
}

/// All of them, in that order.
const ALL: [Panel; 7] =
    [Panel::Question, Panel::Keys, Panel::Find, Panel::Preferences, Panel::Profile, Panel::Why, Panel::Measure];

/// What Escape does.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Escape {
    /// Lets go of the mouse.
    LetGo,
    /// Closes a panel.
    Close(Panel),
    /// Asks whether to quit.
    Ask,
    /// Quits.
    Quit,
}

/// `open`: panels that are, in any order; `unsaved`: something would be lost.
pub fn escape(grabbed: bool, open: &[Panel], unsaved: bool) -> Escape {
    let first = ALL.into_iter().find(|panel| open.contains(panel));
    match (grabbed, first) {
        (true, _) => Escape::LetGo,
        (false, Some(panel)) => Escape::Close(panel),
        (false, None) if unsaved => Escape::Ask,
        (false, None) => Escape::Quit,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn escape_lets_go_then_closes_panels_then_asks_or_quits() {
        let mut open = vec![Panel::Measure, Panel::Why, Panel::Find, Panel::Profile, Panel::Keys, Panel::Preferences];
        assert_eq!(escape(true, &open, true), Escape::LetGo);
        for panel in [Panel::Keys, Panel::Find, Panel::Preferences, Panel::Profile, Panel::Why, Panel::Measure] {
            assert_eq!(escape(false, &open, true), Escape::Close(panel));
            open.retain(|other| *other != panel);
        }
        assert_eq!(escape(false, &open, true), Escape::Ask);
        // Escape at the question is no.
        assert_eq!(escape(false, &[Panel::Keys, Panel::Question], true), Escape::Close(Panel::Question));
        assert_eq!(escape(false, &[], false), Escape::Quit);
        assert_eq!(escape(true, &[], false), Escape::LetGo);
    }
}
