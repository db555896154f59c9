!! Changes that are at one place of a branch: both sides of a symmetric contact, contacts of equal bodies, friction that changes as
!! its stop is touched. Rounding says which is the first, and how much lies between; they have one label.
module razy_orbits_branch_place
   use razy_core_kinds, only: wp
   use razy_orbits_branch_point, only: point_t
   implicit none(type, external)
   private

   public :: are_one, coincident, place_of

   !> Changes of contacts nearer than this, relative to the state, are one.
   real(wp), parameter :: coincident = 1.0e-8_wp
   !> What may be at one place: it is where the first of these is. The branch turns with the change, a fold tells no more of it.
   character(2), parameter :: at_place(*) = ["GR", "ST", "SL", "CH", "LP"]

contains

   !> Whether two special points are at one place, a change of contacts and another one, or a fold.
   pure logical function are_one(a, b)
      type(point_t), intent(in) :: a, b

      are_one = any(at_place == a%label) .and. any(at_place == b%label) .and. (a%label /= "LP" .or. b%label /= "LP")
      if (are_one) are_one = norm2(a%orbit%u - b%orbit%u) < coincident*norm2(b%orbit%u)
   end function are_one

   !> The point of a place with a change, or a fold, behind those of `before`.
   type(point_t) function place_of(before, point) result(both)
      type(point_t), intent(in) :: before, point

      both = before
      if (point%label == "LP") return
      if (tells_more(point, before)) both = point
      both%error = max(before%error, point%error)
      ! As at each of them multipliers are those behind it.
      both%orbit%multiplier = point%orbit%multiplier
      both%orbit%doubt = point%orbit%doubt
   end function place_of

   !> Whether the place is rather that of `a` than of `b`; of several contacts that of the least number.
   pure logical function tells_more(a, b)
      type(point_t), intent(in) :: a, b

      integer :: rank(2)

      rank = [findloc(at_place, a%label, 1), findloc(at_place, b%label, 1)]
      tells_more = rank(1) < rank(2)
      if (rank(1) == rank(2)) tells_more = a%contact > 0 .and. (a%contact < b%contact .or. b%contact == 0)
   end function tells_more

end module razy_orbits_branch_place
