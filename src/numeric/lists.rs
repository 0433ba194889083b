//! Lists that keep their memory while their contents are replaced.

/// Makes a list of so many copies of a value.
pub fn reset<T: Clone>(list: &mut Vec<T>, len: usize, value: T) {
    list.clear();
    list.resize(len, value);
}

/// Replaces the contents of a list.
pub fn refill<T>(list: &mut Vec<T>, items: impl IntoIterator<Item = T>) {
    list.clear();
    list.extend(items);
}

/// Divides each of some lists at an index, or at its end if that comes first: lists of scalars that a liquid does not have are empty.
pub fn split_each<T, const N: usize>(lists: [&mut [T]; N], at: usize) -> [[&mut [T]; N]; 2] {
    let mut behind = [(); N].map(|()| Default::default());
    let mut ends = behind.iter_mut();
    let before = lists.map(|list| {
        let (before, end) = list.split_at_mut(at.min(list.len()));
        *ends.next().expect("as many") = end;
        before
    });
    [before, behind]
}
