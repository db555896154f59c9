!! Machines made by hand for tests, without a namelist.
module machine_samples
   use razy_contact_clearance_law, only: clearance_law_t, clearance_side_t, new_clearance_law
   use razy_contact_contact_law, only: contact_law_t
   use razy_core_kinds, only: qp, wp
   use razy_core_tone, only: tone_from_hertz
   use razy_machine_machine, only: add_named_contact => add_contact, add_observable, machine_t, observe_contact_force, plain_machine
   implicit none(type, external)
   private

   public :: add_contact, add_tone, bare_machine, connect, gear_pair, mesh_law, observe, observe_contact
   public :: observe_force, start_at, stop_law, two_sided_stop, random_numbers

contains

   !> A machine of free bodies with these masses.
   function bare_machine(mass) result(machine)
      real(wp), intent(in) :: mass(:)
      type(machine_t) :: machine

      real(wp) :: none(size(mass), size(mass)), on_diagonal(size(mass), size(mass))
      integer :: i

      none = 0.0_wp
      on_diagonal = 0.0_wp
      do i = 1, size(mass)
         on_diagonal(i, i) = mass(i)
      end do
      machine = plain_machine(on_diagonal, none, none)
      machine%title = "sample"
   end function bare_machine

   !> Add `value` between coordinates i and j (0: the frame) of a stiffness or damping matrix.
   pure subroutine connect(matrix, i, j, value)
      real(wp), intent(inout) :: matrix(:, :)
      integer, intent(in) :: i, j
      real(wp), intent(in) :: value

      if (i > 0) matrix(i, i) = matrix(i, i) + value
      if (j > 0) matrix(j, j) = matrix(j, j) + value
      if (i == 0 .or. j == 0) return
      matrix(i, j) = matrix(i, j) - value
      matrix(j, i) = matrix(j, i) - value
   end subroutine connect

   !> A further frequency of excitation with force phasors `force` (n); contacts and observables that are there feel nothing of it.
   subroutine add_tone(machine, hertz, force)
      type(machine_t), intent(inout) :: machine
      real(qp), intent(in) :: hertz
      complex(wp), intent(in) :: force(:)

      complex(wp), allocatable :: larger(:, :)
      integer :: j, t

      t = size(machine%tone) + 1
      do j = 1, size(machine%contact)
         machine%contact(j)%error = [machine%contact(j)%error, (0.0_wp, 0.0_wp)]
      end do
      do j = 1, size(machine%observable)
         machine%observable(j)%error = [machine%observable(j)%error, (0.0_wp, 0.0_wp)]
      end do
      allocate (larger(size(force), t))
      larger(:, :t - 1) = machine%harmonic_load
      larger(:, t) = force
      call move_alloc(larger, machine%harmonic_load)
      machine%tone = [machine%tone, tone_from_hertz(hertz)]
   end subroutine add_tone

   !> A contact on wᵀq + offset + Re(Σ error e^{iωt}).
   subroutine add_contact(machine, w, law, offset, error)
      type(machine_t), intent(inout) :: machine
      real(wp), intent(in) :: w(:)
      class(contact_law_t), intent(in) :: law
      real(wp), intent(in), optional :: offset
      complex(wp), intent(in), optional :: error(:)

      call add_named_contact(machine, "contact", w, law)
      associate (contact => machine%contact(size(machine%contact)))
         if (present(offset)) contact%offset = offset
         if (present(error)) contact%error = error
      end associate
   end subroutine add_contact

   !> The observable aᵀq + bᵀq'.
   subroutine observe(machine, a, b)
      type(machine_t), intent(inout) :: machine
      real(wp), intent(in) :: a(:), b(:)

      call add_observable(machine, "form", "m", a, b)
   end subroutine observe

   !> The variable of contact j as an observable.
   subroutine observe_contact(machine, j)
      type(machine_t), intent(inout) :: machine
      integer, intent(in) :: j

      call observe(machine, machine%contact(j)%w, 0.0_wp*machine%contact(j)%w)
      associate (observable => machine%observable(size(machine%observable)))
         observable%constant = machine%contact(j)%offset
         observable%error = machine%contact(j)%error
      end associate
   end subroutine observe_contact

   !> The force of contact j as an observable.
   subroutine observe_force(machine, j)
      type(machine_t), intent(inout) :: machine
      integer, intent(in) :: j

      call observe_contact(machine, j)
      machine%observable(size(machine%observable))%kind = observe_contact_force
      machine%observable(size(machine%observable))%contact = j
   end subroutine observe_force

   subroutine start_at(machine, displacement, velocity)
      type(machine_t), intent(inout) :: machine
      real(wp), intent(in) :: displacement(:), velocity(:)

      machine%displacement = displacement
      machine%velocity = velocity
   end subroutine start_at

   !> A stop that acts for s > clearance, for s < -clearance, or both.
   function stop_law(side, clearance, stiffness, damping, zero_force) result(law)
      character(*), intent(in) :: side
      real(wp), intent(in) :: clearance, stiffness
      real(wp), intent(in), optional :: damping
      logical, intent(in), optional :: zero_force
      type(clearance_law_t) :: law

      real(wp) :: b
      logical :: by_force

      b = 0.0_wp
      if (present(damping)) b = damping
      by_force = .false.
      if (present(zero_force)) by_force = zero_force
      law = new_clearance_law(clearance_side_t(side /= "upper", -clearance, stiffness, b), &
                              clearance_side_t(side /= "lower", clearance, stiffness, b), by_force)
   end function stop_law

   function mesh_law(backlash, stiffness, damping, zero_force) result(law)
      real(wp), intent(in) :: backlash, stiffness, damping
      logical, intent(in) :: zero_force
      type(clearance_law_t) :: law

      law = new_clearance_law(clearance_side_t(.true., -backlash, stiffness, damping), &
                              clearance_side_t(.true., 0.0_wp, stiffness, damping), zero_force)
   end function mesh_law

   !> The torsional gear pair of the source thesis, d observed, started in the static equilibrium known in closed form.
   function gear_pair(torque, rpm) result(machine)
      real(wp), intent(in) :: torque, rpm
      type(machine_t) :: machine

      real(wp), parameter :: k = 6.2905e4_wp, alpha = 5.0e-4_wp, r = 0.08_wp, k_z = 8.0e8_wp
      real(wp) :: d, twist

      machine = bare_machine([0.1_wp, 0.00794_wp, 0.00794_wp, 0.1_wp])
      call connect(machine%stiffness, 1, 2, k)
      call connect(machine%stiffness, 3, 4, k)
      machine%damping = alpha*machine%stiffness
      machine%load = [torque, 0.0_wp, 0.0_wp, -torque]
      call add_tone(machine, 40*real(rpm, qp)/60, [complex(wp) ::(0.0_wp, 0.0_wp), (0.0_wp, 0.0_wp), &
                                                   (0.0_wp, 0.0_wp), (0.0_wp, 0.0_wp)])
      call add_contact(machine, [0.0_wp, r, -r, 0.0_wp], mesh_law(1.0e-4_wp, k_z, 0.0_wp, .false.), &
                       error=[cmplx(0.0_wp, -5.0e-5_wp, wp)])
      call observe_contact(machine, 1)
      d = torque/(r*k_z)
      twist = torque/k
      machine%displacement = [0.5_wp*d/r + twist, 0.5_wp*d/r, -0.5_wp*d/r, -0.5_wp*d/r - twist]
   end function gear_pair

   !> The undamped two-sided stop of the source thesis; displacement and velocity are observed.
   function two_sided_stop() result(machine)
      type(machine_t) :: machine

      machine = bare_machine([3.5_wp])
      call connect(machine%stiffness, 1, 0, 1.0e5_wp)
      call add_contact(machine, [1.0_wp], stop_law("both", 7.0e-4_wp, 1.0e6_wp))
      call observe(machine, [1.0_wp], [0.0_wp])
      call observe(machine, [0.0_wp], [1.0_wp])
      call start_at(machine, [0.0_wp], [0.2_wp])
   end function two_sided_stop

   !> Numbers evenly spread over (0, 1) from `seed`, the same everywhere (Park and Miller's generator).
   subroutine random_numbers(seed, x)
      integer, intent(inout) :: seed
      real(wp), intent(out) :: x(:)

      integer :: i

      do i = 1, size(x)
         seed = 48271*modulo(seed, 44488) - 3399*(seed/44488)
         if (seed <= 0) seed = seed + huge(seed)
         x(i) = real(seed, wp)/huge(seed)
      end do
   end subroutine random_numbers

end module machine_samples
