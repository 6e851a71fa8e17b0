//! Order of the renders of a race.

use halflight::render::FairSchedule;
use std::sync::Mutex;

#[test]
fn one_at_a_time_and_the_slow_ones_less_often() {
    let schedule = FairSchedule::new(3);
    let order = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for index in (0..3).rev() {
            let (schedule, order) = (&schedule, &order);
            scope.spawn(move || {
                let turn = schedule.join(index);
                for round in 1..=4 {
                    order.lock().unwrap().push(index);
                    // The second render takes twice as long.
                    turn.pass(f64::from(round) * if index == 1 { 2.0 } else { 1.0 });
                }
            });
        }
    });
    assert_eq!(*order.lock().unwrap(), [0, 1, 2, 0, 2, 0, 1, 2, 0, 2, 1, 1]);
}
