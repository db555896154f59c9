!! The Campbell diagram: eigenvalues over the speed, each followed by its shape, and where lines of excitation cross them.
!!
!! Where shapes change too much for eigenvalues of neighbouring speeds to be told, the interval is halved. Critical speeds are
!! looked for on all branches, also on those beyond the modes asked for.
module razy_rotor_whirl_campbell
   use razy_core_error, only: error_t
   use razy_core_kinds, only: wp
   use razy_core_verdict, only: is_absent, is_neutral
   use razy_eigen_branches, only: family_t, follow, walk_t
   use razy_eigen_spectrum, only: spectrum_t
   use razy_linalg_dense, only: rising_order
   use razy_rotor_model, only: rotor_model_t
   use razy_rotor_whirl_critical, only: critical_t, find_critical, in_order, likely
   use razy_rotor_whirl_family, only: whirl_family_t
   use razy_rotor_whirl_stability, only: worst_of
   use razy_rotor_whirl_whirl, only: separate_whirl, whirl_direction
   implicit none(type, external)
   private

   public :: campbell_t, new_campbell

   !> Intervals are halved so often at most, for modes beyond those asked for less often.
   integer, parameter :: most_halvings = 10, halvings_beyond = 2

   !> Rigid motions that nothing feels, each once with the eigenvalue 0, then
   !> eigenvalues (modes, speeds) with Im >= 0 in the order of their imaginary parts, 1/s and rad/s; the branch that each belongs
   !> to; the direction of its orbits, see `whirl_direction`. Modes that a speed does not have are 0 in `branch`.
   type :: campbell_t
      real(wp), allocatable :: speed(:)
      complex(wp), allocatable :: value(:, :)
      integer, allocatable :: branch(:, :)
      real(wp), allocatable :: direction(:, :)
      !> With damping, what the modes (modes, speeds) and all eigenvalues together (speeds) say of stability; verdicts of
      !> razy_core_verdict.
      integer, allocatable :: verdict(:, :), worst(:)
      type(critical_t), allocatable :: critical(:)
      !> Crossings that were seen but not located, because shapes changed too much.
      integer :: lost = 0
   end type campbell_t

   !> What is looked for on the way from speed to speed, and what was found so far.
   type, extends(walk_t) :: search_t
      type(rotor_model_t) :: model
      !> Excitation orders; modes asked for.
      real(wp), allocatable :: order(:)
      integer :: modes = 0
      !> The interval under way, rad/s.
      real(wp) :: interval = 0.0_wp
      integer :: branches = 0, lost = 0
      type(critical_t), allocatable :: critical(:)
   contains
      procedure :: is_fine
      procedure :: take
   end type search_t

contains

   !> The diagram at the rising speeds `speed`, rad/s, of `modes` modes, with critical speeds for the excitation orders `order`.
   subroutine new_campbell(diagram, problem, model, speed, modes, order, error)
      type(campbell_t), intent(out) :: diagram
      class(whirl_family_t), intent(in) :: problem
      type(rotor_model_t), intent(in) :: model
      real(wp), intent(in) :: speed(:), order(:)
      integer, intent(in) :: modes
      type(error_t), allocatable, intent(out) :: error

      type(spectrum_t) :: front
      type(search_t) :: search
      class(whirl_family_t), allocatable :: family
      integer, allocatable :: verdict(:)
      integer :: i, k, rigid

      family = problem
      search%model = model
      search%order = order
      rigid = min(problem%untouched, modes)
      search%modes = modes - rigid
      allocate (search%critical(0))
      diagram%speed = speed
      allocate (diagram%value(modes, size(speed)), source=(0.0_wp, 0.0_wp))
      allocate (diagram%branch(modes, size(speed)), source=0)
      allocate (diagram%direction(modes, size(speed)), source=0.0_wp)
      allocate (diagram%worst(size(speed)), source=is_neutral)
      allocate (diagram%verdict(modes, size(speed)), source=is_absent)
      call family%solve(speed(1), front, error)
      if (allocated(error)) return
      call separate_whirl(front, family, model)
      search%branches = size(front%value)
      do k = 1, size(speed)
         if (k > 1) then
            search%interval = speed(k) - front%parameter
            call follow(search, family, front, speed(k), error)
            if (allocated(error)) return
         end if
         diagram%branch(:rigid, k) = [(i, i=1, rigid)]
         diagram%verdict(:rigid, k) = is_neutral
         verdict = spread(is_neutral, 1, size(front%value))
         if (problem%damped) call problem%judge(front, verdict)
         diagram%worst(k) = worst_of(verdict)
         associate (chosen => lowest(front%value, modes - rigid))
            do i = 1, size(chosen)
               diagram%value(rigid + i, k) = front%value(chosen(i))
               diagram%verdict(rigid + i, k) = verdict(chosen(i))
               diagram%branch(rigid + i, k) = problem%untouched + front%branch(chosen(i))
               diagram%direction(rigid + i, k) = whirl_direction(model, problem%shape_of(front%shape(:, chosen(i))))
            end do
         end associate
      end do
      associate (found => search%critical)
         diagram%critical = in_order(pack(found, resonates(cmplx(found%growth, found%frequency, wp))))
      end associate
      diagram%critical%branch = problem%untouched + diagram%critical%branch
      diagram%lost = search%lost
   end subroutine new_campbell

   !> The places of the `count` values of smallest modulus, or all if there are fewer, in the order that they have.
   pure function lowest(value, count) result(chosen)
      complex(wp), intent(in) :: value(:)
      integer, intent(in) :: count
      integer, allocatable :: chosen(:)

      chosen = rising_order(abs(value))
      chosen = chosen(:min(count, size(value)))
      chosen = chosen(rising_order(real(chosen, wp)))
   end function lowest

   !> Whether every mode that matters has a shape like that of the mode it continues, or was given enough halvings: those
   !> asked for all of them, those beyond that a line of excitation can cross on the way a few.
   function is_fine(self, before, after)
      class(search_t), intent(inout) :: self
      type(spectrum_t), intent(in) :: before, after
      logical :: is_fine

      integer :: halvings, wanted(size(after%value))

      halvings = nint(log(self%interval/(after%parameter - before%parameter))/log(2.0_wp))
      wanted = 0
      if (size(self%order) > 0) then
         where (after%value%im >= minval(self%order)*before%parameter .and. after%value%im <= maxval(self%order)*after%parameter)
            wanted = halvings_beyond
         end where
      end if
      wanted(lowest(after%value, self%modes)) = most_halvings
      is_fine = .not. any(after%likeness < likely .and. halvings < wanted)
   end function is_fine

   !> Give new branches to modes that continue none, and find the critical speeds in the step.
   subroutine take(self, family, before, after, error)
      class(search_t), intent(inout) :: self
      class(family_t), intent(inout) :: family
      type(spectrum_t), intent(in) :: before
      type(spectrum_t), intent(inout) :: after
      type(error_t), allocatable, intent(out) :: error

      type(critical_t) :: critical
      complex(wp), allocatable :: shape(:)
      integer :: i, j, k
      logical :: crossed, equal, found, lost_after(size(after%value)), lost_before(size(before%value))

      lost_after = after%likeness < likely
      lost_before = [(all(lost_after .or. after%branch /= before%branch(i)), i=1, size(before%value))]
      ! Crossings that no branch shows: what is lost on one side is not what is found anew on the other.
      self%lost = self%lost + sum([(abs(count(lost_before .and. below(before, self%order(k))) &
                                        - count(lost_after .and. below(after, self%order(k)))), k=1, size(self%order))])
      select type (family)
      class is (whirl_family_t)
         do j = 1, size(after%value)
            if (lost_after(j)) then
               self%branches = self%branches + 1
               after%branch(j) = self%branches
               cycle
            end if
            i = findloc(before%branch, after%branch(j), dim=1)
            do k = 1, size(self%order)
               call find_critical(critical, shape, crossed, found, family, self%order(k), before, i, after, j, error)
               if (allocated(error)) return
               if (.not. crossed) cycle
               if (found) then
                  ! Of equal eigenvalues Newton's method keeps no single shape: rounding turns it in their space.
                  equal = all([count(before%first == before%first(i)), count(after%first == after%first(j))] > 1)
                  if (equal) shape = after%shape(:, j)
                  critical%direction = whirl_direction(self%model, family%shape_of(shape))
                  self%critical = [self%critical, critical]
               else if (resonates(before%value(i)) .or. resonates(after%value(j))) then
                  self%lost = self%lost + 1
               end if
            end do
         end do
      end select
   end subroutine take

   !> A motion damped by more than 1/sqrt(2) of the critical damping has no resonance.
   elemental logical function resonates(value)
      complex(wp), intent(in) :: value

      resonates = abs(value%re) < value%im
   end function resonates

   !> Which modes resonate and are not above the line of excitation of an order.
   pure function below(spectrum, order)
      type(spectrum_t), intent(in) :: spectrum
      real(wp), intent(in) :: order
      logical :: below(size(spectrum%value))

      below = resonates(spectrum%value) .and. spectrum%value%im <= order*spectrum%parameter
   end function below

end module razy_rotor_whirl_campbell
