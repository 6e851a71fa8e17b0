//! Notes on repairs.

use halflight::load::Notes;

#[test]
fn each_kind_has_a_count_and_its_first_line() {
    let mut notes = Notes::of("a.obj");
    notes.at(7, "face with two corners left out");
    let mut later = Notes::of("a.obj");
    later.at(9, "face with two corners left out");
    later.add(3, "zero normal");
    later.add(0, "nothing");
    notes.merge(later);
    let expected = ["face with two corners left out, 2 times (first: a.obj:7)", "zero normal, 3 times"];
    assert_eq!(notes.sentences(), expected);
}
