!! Branches of eigenmodes over a parameter: each followed by its shape from value to value, through crossings and veerings.
!!
!! What the eigenproblems are is said by a `family_t`, and what is to become of the modes by a `walk_t`: it says whether a step from
!! value to value is fine enough, otherwise the step is halved, and it takes the steps that are.
module razy_eigen_branches
   use razy_core_error, only: error_t
   use razy_core_kinds, only: wp
   use razy_eigen_spectrum, only: continue_branches, spectrum_t
   use razy_linalg_bracketed_root, only: bracketed_root_t
   implicit none(type, external)
   private

   public :: family_t, find_crossing, follow, line_t, walk_t

   !> A step is taken as it is if so many lie ahead.
   integer, parameter :: most_halvings = 60

   !> Eigenproblems with a parameter.
   type, abstract :: family_t
   contains
      procedure(solve), deferred :: solve
   end type family_t

   !> What is done on the way.
   type, abstract :: walk_t
   contains
      procedure(is_fine), deferred :: is_fine
      procedure(take), deferred :: take
   end type walk_t

   !> A line that branches cross where Re(factor λ) + slope p + constant = 0, p being the parameter.
   type :: line_t
      complex(wp) :: factor = (1.0_wp, 0.0_wp)
      real(wp) :: slope = 0.0_wp, constant = 0.0_wp
   contains
      procedure :: height
   end type line_t

   abstract interface
      !> Eigenvalues and shapes for a value of the parameter; an error if there is no such problem, or no solution.
      subroutine solve(self, parameter, spectrum, error)
         import :: error_t, family_t, spectrum_t, wp
         implicit none(type, external)
         class(family_t), intent(inout) :: self
         real(wp), intent(in) :: parameter
         type(spectrum_t), intent(out) :: spectrum
         type(error_t), allocatable, intent(out) :: error
      end subroutine solve

      !> Whether the step from `before` to `after`, whose modes have their branches, need not be halved.
      function is_fine(self, before, after)
         import :: spectrum_t, walk_t
         implicit none(type, external)
         class(walk_t), intent(inout) :: self
         type(spectrum_t), intent(in) :: before, after
         logical :: is_fine
      end function is_fine

      !> Take a step. Branches may be changed.
      subroutine take(self, family, before, after, error)
         import :: error_t, family_t, spectrum_t, walk_t
         implicit none(type, external)
         class(walk_t), intent(inout) :: self
         class(family_t), intent(inout) :: family
         type(spectrum_t), intent(in) :: before
         type(spectrum_t), intent(inout) :: after
         type(error_t), allocatable, intent(out) :: error
      end subroutine take
   end interface

contains

   !> Follow the modes from `front` to the value `target`, in as many steps as it takes; `front` is then there.
   subroutine follow(walk, family, front, target, error)
      class(walk_t), intent(inout) :: walk
      class(family_t), intent(inout) :: family
      type(spectrum_t), intent(inout) :: front
      real(wp), intent(in) :: target
      type(error_t), allocatable, intent(out) :: error

      ! Spectra ahead, the nearest last.
      type(spectrum_t) :: ahead(most_halvings + 1)
      integer :: n
      logical :: fine

      call family%solve(target, ahead(1), error)
      n = 1
      do while (n > 0 .and. .not. allocated(error))
         call continue_branches(front, ahead(n))
         fine = n > most_halvings
         if (.not. fine) fine = walk%is_fine(front, ahead(n))
         if (.not. fine) then
            n = n + 1
            call family%solve(front%parameter + 0.5_wp*(ahead(n - 1)%parameter - front%parameter), ahead(n), error)
         else
            call walk%take(family, front, ahead(n), error)
            front = ahead(n)
            n = n - 1
         end if
      end do
   end subroutine follow

   !> Where on a branch between two spectra, at which their heights have opposite signs or one is zero, a line is crossed: the
   !> spectrum `at` there and the mode `place` in it, 0 if the branch was lost. `tolerance`: of the parameter, relative;
   !> rounding if not given.
   !>
   !> Each trial is matched with the end of the bracket at which fewer modes are degenerate with this one, else with the nearer end.
   subroutine find_crossing(family, before, after, branch, line, at, place, error, tolerance)
      class(family_t), intent(inout) :: family
      type(spectrum_t), intent(in) :: before, after
      integer, intent(in) :: branch
      type(line_t), intent(in) :: line
      type(spectrum_t), intent(out) :: at
      integer, intent(out) :: place
      type(error_t), allocatable, intent(out) :: error
      real(wp), intent(in), optional :: tolerance

      type(bracketed_root_t) :: root
      type(spectrum_t) :: side(2), trial
      real(wp) :: f, height(2)
      integer :: i, k

      side = [before, after]
      height = [(line%height(side(k), findloc(side(k)%branch, branch, dim=1)), k=1, 2)]
      at = side(merge(1, 2, abs(height(1)) <= abs(height(2))))
      call root%start(before%parameter, height(1), after%parameter, height(2), tolerance)
      place = 0
      do while (.not. root%done())
         call family%solve(root%trial, trial, error)
         if (allocated(error)) return
         call continue_branches(side(better_side(side, branch, trial%parameter)), trial)
         i = findloc(trial%branch, branch, dim=1)
         if (i == 0) return
         f = line%height(trial, i)
         call root%take(f)
         if (.not. abs(root%best - trial%parameter) > 0.0_wp) at = trial
         k = merge(1, 2, f < 0.0_wp .eqv. height(1) < 0.0_wp)
         side(k) = trial
         height(k) = f
      end do
      place = findloc(at%branch, branch, dim=1)
   end subroutine find_crossing

   !> The spectrum of two by which a branch is recognised at a value between.
   pure integer function better_side(side, branch, parameter)
      type(spectrum_t), intent(in) :: side(2)
      integer, intent(in) :: branch
      real(wp), intent(in) :: parameter

      integer :: equals(2), k

      equals = [(size(side(k)%equals_of(findloc(side(k)%branch, branch, dim=1))), k=1, 2)]
      better_side = minloc(equals, dim=1)
      if (equals(1) == equals(2)) better_side = minloc(abs(side%parameter - parameter), dim=1)
   end function better_side

   !> How far mode `place` is above the line.
   pure function height(self, spectrum, place)
      class(line_t), intent(in) :: self
      type(spectrum_t), intent(in) :: spectrum
      integer, intent(in) :: place
      real(wp) :: height

      height = real(self%factor*spectrum%value(place), wp) + self%slope*spectrum%parameter + self%constant
   end function height

end module razy_eigen_branches
