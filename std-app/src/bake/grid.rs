//! Cells of a grid that take their values from known neighbours, ring by ring: texels of a map, probes.

/// A grid of cells, the first axis fastest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Grid(pub(super) [usize; 3]);

impl Grid {
    /// Number of cells.
    pub(super) fn len(&self) -> usize {
        self.0.iter().product()
    }

    /// The column, row and slice of a cell.
    pub(super) fn place(&self, cell: usize) -> [usize; 3] {
        let [width, height, _] = self.0;
        [cell % width, cell / width % height, cell / (width * height)]
    }

    /// The cells that touch `cell`.
    fn neighbours(self, cell: usize) -> impl Iterator<Item = usize> {
        let place = self.place(cell);
        let [across, down, deep] = [0, 1, 2].map(|axis| {
            let (at, side) = (place[axis], self.0[axis]);
            at.saturating_sub(1)..(at + 2).min(side)
        });
        let rows = deep.flat_map(move |z| down.clone().map(move |y| self.0[0] * (y + self.0[1] * z)));
        rows.flat_map(move |row| across.clone().map(move |x| row + x)).filter(move |other| *other != cell)
    }

    /// Makes unknown cells known in at most `rings` rings around the known ones: `take(cell, from)` is called
    /// for each, with the known neighbours of which `may_take(cell, neighbour)` holds. Where `watch` returns
    /// false, the other cells stay unknown.
    pub(super) fn fill(
        self,
        is_known: &mut [bool],
        rings: usize,
        may_take: impl Fn(usize, usize) -> bool,
        mut take: impl FnMut(usize, &[usize]),
        watch: &dyn Fn() -> bool,
    ) {
        let may_take = &may_take;
        let is_source =
            |is_known: &[bool], cell: usize, other: usize| is_known[other] && may_take(cell, other);
        let has_source = |cell: usize| self.neighbours(cell).any(|other| is_source(is_known, cell, other));
        let rows = (0..self.len()).step_by(self.0[0].max(1)).take_while(|_| watch());
        let cells = rows.flat_map(|first| first..first + self.0[0]);
        let mut ring: Vec<usize> = cells.filter(|&cell| !is_known[cell] && has_source(cell)).collect();
        let mut sources = Vec::new();
        for _ in (0..rings).take_while(|_| watch()) {
            for &cell in &ring {
                sources.clear();
                sources.extend(self.neighbours(cell).filter(|&other| is_source(is_known, cell, other)));
                take(cell, &sources);
            }
            ring.iter().for_each(|&cell| is_known[cell] = true);
            let around = |&cell: &usize| {
                self.neighbours(cell).filter(move |&next| may_take(next, cell)).collect::<Vec<_>>()
            };
            ring = ring.iter().flat_map(around).filter(|&cell| !is_known[cell]).collect();
            ring.sort_unstable();
            ring.dedup();
            if ring.is_empty() {
                return;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values after a fill of a row of cells; the first known cell of each is its value.
    fn filled(cells: &str, rings: usize, may_take: impl Fn(usize, usize) -> bool) -> String {
        let mut values: Vec<char> = cells.chars().collect();
        let mut is_known: Vec<bool> = values.iter().map(|value| *value != '.').collect();
        let grid = Grid([values.len(), 1, 1]);
        let take = |cell: usize, from: &[usize]| values[cell] = values[from[0]];
        grid.fill(&mut is_known, rings, may_take, take, &|| true);
        values.into_iter().collect()
    }

    #[test]
    fn nearest_known_cells_give_their_values() {
        assert_eq!(filled("a....b...", 99, |_, _| true), "aaabbbbbb");
        assert_eq!(filled("a....b...", 1, |_, _| true), "aa..bbb..");
        assert_eq!(filled("a....b...", 0, |_, _| true), "a....b...");
        assert_eq!(filled(".....", 9, |_, _| true), ".....");
        // A border between the third and fourth cell.
        assert_eq!(filled("a....b", 99, |to, from| (to < 3) == (from < 3)), "aaabbb");
        assert_eq!(filled("a.....", 99, |to, from| (to < 3) == (from < 3)), "aaa...");
    }

    #[test]
    fn a_watch_ends_the_filling() {
        let (mut is_known, calls) = ([true, false, false, false], core::cell::Cell::new(0));
        let watch = || {
            calls.set(calls.get() + 1);
            calls.get() <= 2
        };
        // The one row and the first ring are allowed.
        Grid([4, 1, 1]).fill(&mut is_known, usize::MAX, |_, _| true, |_, _| (), &watch);
        assert_eq!(is_known, [true, true, false, false]);
    }

    #[test]
    fn neighbours_touch_in_all_axes() {
        let grid = Grid([3, 4, 5]);
        assert_eq!(grid.neighbours(0).count(), 7);
        assert_eq!(grid.neighbours(1 + 3 * (1 + 4 * 2)).count(), 26);
        let all = |cell: usize| grid.neighbours(cell).all(|other| grid.neighbours(other).any(|x| x == cell));
        assert!((0..grid.len()).all(all));
    }
}
