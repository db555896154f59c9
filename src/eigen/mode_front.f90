!! All modes of a machine at one value of a parameter, and which of them is watched.
module razy_eigen_mode_front
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: wp
   use razy_core_number, only: to_text
   use razy_eigen_mode_match, only: align_modes, coincidence
   use razy_eigen_modes, only: energy_shares, modes_no_mass, modes_ok, modes_t, natural_modes
   implicit none(type, external)
   private

   public :: change_places, compute_front, family_at, front_t, identify, is_watched, place_of, share_of, watch_t

   !> Shares that differ by less count as equal: next to a crossing, rounding mixes the shapes by this much.
   real(wp), parameter :: tie = 1.0e-5_wp

   !> What is looked for: the mode with the greatest share of `coordinate` if that is not 0, else mode number `mode` at the start.
   type :: watch_t
      integer :: coordinate = 0, mode = 0
      !> λ = ω² that it shall have, 1/s².
      real(wp) :: goal = 0.0_wp
   end type watch_t

   !> The modes, the shares (coordinate, mode), the mode watched and the coordinate with the greatest share in it.
   type :: front_t
      real(wp) :: parameter = 0.0_wp
      type(modes_t) :: modes
      real(wp), allocatable :: share(:, :)
      integer :: branch = 0, coordinate = 0
   end type front_t

   abstract interface
      !> M and K of the machine with this value of the parameter; `context` is what the caller handed over.
      subroutine family_at(context, parameter, mass, stiffness, error)
         import :: error_t, wp
         implicit none(type, external)
         class(*), intent(inout) :: context
         real(wp), intent(in) :: parameter
         real(wp), allocatable, intent(out) :: mass(:, :), stiffness(:, :)
         type(error_t), allocatable, intent(out) :: error
      end subroutine family_at
   end interface

contains

   !> All modes for a value of the parameter, in the order of `reference` where it is given.
   subroutine compute_front(front, family, context, parameter, error, reference, overlap)
      type(front_t), intent(out) :: front
      procedure(family_at) :: family
      class(*), intent(inout) :: context
      real(wp), intent(in) :: parameter
      type(error_t), allocatable, intent(out) :: error
      type(modes_t), intent(in), optional :: reference
      real(wp), intent(out), optional :: overlap(:)

      real(wp), allocatable :: mass(:, :), stiffness(:, :)
      integer :: status

      front%parameter = parameter
      call family(context, parameter, mass, stiffness, error)
      if (allocated(error)) return
      call natural_modes(front%modes, mass, stiffness, status)
      if (status == modes_no_mass) then
         call raise(error, "the mass matrix is not positive definite at the value "//to_text(parameter))
      else if (status /= modes_ok) then
         call raise(error, "the eigenproblem could not be solved at the value "//to_text(parameter))
      end if
      if (allocated(error)) return
      if (present(reference)) call align_modes(front%modes, reference, mass, overlap)
      front%share = energy_shares(front%modes, mass)
   end subroutine compute_front

   !> Find the mode watched and its strongest coordinate. In a tie they stay what they were at the point `before`, if any.
   subroutine identify(front, watch, before)
      type(front_t), intent(inout) :: front
      type(watch_t), intent(in) :: watch
      type(front_t), intent(in) :: before

      integer :: branch, coordinate

      branch = merge(before%branch, watch%mode, before%branch > 0)
      if (watch%coordinate > 0) then
         branch = maxloc(front%share(watch%coordinate, :), dim=1)
         if (before%branch > 0) then
            if (front%share(watch%coordinate, branch) - front%share(watch%coordinate, before%branch) <= tie) branch = before%branch
         end if
      end if
      coordinate = maxloc(front%share(:, branch), dim=1)
      if (before%coordinate > 0) then
         if (front%share(coordinate, branch) - front%share(before%coordinate, branch) <= tie) coordinate = before%coordinate
      end if
      front%branch = branch
      front%coordinate = coordinate
   end subroutine identify

   !> Whether a mode is what is looked for: of all modes the one with most of the coordinate, or the branch of the mode.
   pure function is_watched(front, watch, branch)
      type(front_t), intent(in) :: front
      type(watch_t), intent(in) :: watch
      integer, intent(in) :: branch
      logical :: is_watched

      is_watched = branch == watch%mode
      if (watch%coordinate > 0) is_watched = share_of(front, watch, branch) >= maxval(front%share(watch%coordinate, :)) - tie
   end function is_watched

   !> The share in a mode of the coordinate looked for, or of its strongest.
   pure function share_of(front, watch, branch) result(share)
      type(front_t), intent(in) :: front
      type(watch_t), intent(in) :: watch
      integer, intent(in) :: branch
      real(wp) :: share

      if (watch%coordinate > 0) then
         share = front%share(watch%coordinate, branch)
      else
         share = maxval(front%share(:, branch))
      end if
   end function share_of

   !> Whether any two branches change places, meet or part from the values `before` to those `after`.
   pure function change_places(before, after) result(change)
      real(wp), intent(in) :: before(:), after(:)
      logical :: change

      real(wp) :: gap_before, gap_after
      integer :: b

      gap_before = coincidence(before)
      gap_after = coincidence(after)
      change = .false.
      do b = 1, size(before)
         change = change .or. any((before > before(b) + gap_before) .neqv. (after > after(b) + gap_after))
      end do
   end function change_places

   !> The place in ascending order of branch `b`; of branches that coincide the first.
   pure function place_of(value, b) result(place)
      real(wp), intent(in) :: value(:)
      integer, intent(in) :: b
      integer :: place

      place = 1 + count(value < value(b) - coincidence(value))
   end function place_of

end module razy_eigen_mode_front
