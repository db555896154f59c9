!! The machine: what every scene becomes, and all that an integrator knows.
!!
!!     M q'' + B q' + K q = f0 + Σ_t Re(F_t e^{iω_t t}) - Σ_j w_j F_j(s_j, s_j'),
!!     s_j = w_jᵀ q + c_j + Σ_t Re(e_jt e^{iω_t t}),
!!
!! with the contact laws F_j. For a friction element s' is the sliding velocity, w_jᵀq' + drive + error rate, and F_j grows with
!! the normal force: a constant one, or the force of another contact. The force of a gear mesh may vary with the phase of its teeth:
!! by a factor 1 + Re Σ_t m_jt e^{iω_t t}, or between branches with n and with n + 1 pairs of teeth in mesh.
!! A machine is made once and not changed; a sweep makes another for each point.
module razy_machine_machine
   use razy_contact_contact_law, only: contact_law_t, same_slopes
   use razy_core_kinds, only: wp
   use razy_core_text, only: string_t
   use razy_core_tone, only: tone_t
   use razy_linalg_null_space, only: intersection_of, null_space
   use razy_machine_by_speed, only: by_speed_t
   use razy_machine_frame, only: frame_t, outward
   implicit none(type, external)
   private

   public :: add_contact, add_observable, contact_rows, contact_t, find_free_motions, is_ring, machine_t, mass_complaint, &
             observable_t, plain_machine, push_of, same_at_rest, same_structure, stretch_of
   public :: observe_linear, observe_contact_force, observe_in_plane

   !> One contact: direction `w` (n), constant `offset` and excitation `error` (tones) of its variable s, and its law.
   type :: contact_t
      character(:), allocatable :: name
      real(wp), allocatable :: w(:)
      real(wp) :: offset = 0.0_wp
      complex(wp), allocatable :: error(:)
      class(contact_law_t), allocatable :: law
      !> That of a contact in a plane: then s, or with friction s', is no linear function of the state (razy_machine_frame).
      type(frame_t), allocatable :: frame
      !> Constant part of s' beside that of `w` and `error`: speed of a belt, m/s (rad/s).
      real(wp) :: drive = 0.0_wp
      !> Its rate in a run-up, m/s² (rad/s²).
      real(wp) :: drive_rate = 0.0_wp
      !> Normal force of a friction element, N (N m): `normal`, plus the force of contact `normal_of` if that is not 0.
      real(wp) :: normal = 0.0_wp
      integer :: normal_of = 0
      !> A contact while which is open or parting the normal force is 0, and so there is no friction; 0: none.
      integer :: only_with = 0
      !> +1 if a reported contact force has the sign of F (mesh), -1 if it counts positive on the lower side (stop).
      real(wp) :: force_sign = 1.0_wp
      !> m (tones), if the stiffness varies by harmonics.
      complex(wp), allocatable :: modulation(:)
      !> If it switches, the tone of the teeth; from the phase on levels 2, 3, ... of the law follow one another, level i up to the
      !> part `mesh_end`(i) of a period (levels; the first is 0), and then the first to its end.
      integer :: mesh_tone = 0
      real(wp) :: mesh_phase = 0.0_wp
      real(wp), allocatable :: mesh_end(:)
      !> Unit of s and of F.
      character(:), allocatable :: unit, force_unit
   end type contact_t

   !> Kinds of observable: linear in the state; the force of a contact; of a contact in a plane s, or of friction s'.
   integer, parameter :: observe_linear = 1, observe_contact_force = 2, observe_in_plane = 3

   !> A quantity that is recorded: aᵀq + bᵀq' + constant + Re(Σ error_t e^{iω_t t}), or a contact's force.
   type :: observable_t
      character(:), allocatable :: name, unit, long_name
      integer :: kind = observe_linear
      real(wp), allocatable :: on_displacement(:), on_velocity(:)
      real(wp) :: constant = 0.0_wp
      complex(wp), allocatable :: error(:)
      integer :: contact = 0
   end type observable_t

   !> The machine with n coordinates.
   type :: machine_t
      character(:), allocatable :: title
      !> Names of the coordinates (n), units of displacement and velocity (n).
      character(64), allocatable :: coordinate(:)
      character(16), allocatable :: unit(:), rate_unit(:)
      !> M, B, K (n, n): kg (kg m²), N s/m (N m s/rad), N/m (N m/rad).
      real(wp), allocatable :: mass(:, :), damping(:, :), stiffness(:, :)
      !> Motions that no spring holds, and of these those that no damper feels, all contacts open (n, r each): orthonormal, from the
      !> directions of the elements, not from the matrices that these add up to. Not allocated where elements are not known.
      real(wp), allocatable :: free_of_stiffness(:, :), free_of_both(:, :)
      !> f0 (n), N (N m).
      real(wp), allocatable :: load(:)
      !> Frequencies of excitation and force phasors F (n, tones).
      type(tone_t), allocatable :: tone(:)
      complex(wp), allocatable :: harmonic_load(:, :)
      !> Speed of the rotation at time 0, rad/s, and its rate, rad/s², where the scene has one.
      real(wp) :: speed = 0.0_wp, acceleration = 0.0_wp
      !> The longest period that is given to a load whose amplitude is 0, s; 0 if there is none.
      real(wp) :: given_period = 0.0_wp
      !> By what K and B change with the speed, where they do in this motion.
      type(by_speed_t), allocatable :: by_speed
      type(contact_t), allocatable :: contact(:)
      !> Whether of rigid contacts that touch those that approach are hit alone, one after the other, and not all at once.
      logical :: impacts_in_turn = .false.
      type(observable_t), allocatable :: observable(:)
      !> State at the start of the motion (n each).
      real(wp), allocatable :: displacement(:), velocity(:)
      !> Displacements up to which the geometry holds (n); not allocated where it does for all.
      real(wp), allocatable :: holds_to(:)
      !> What a user should know of the model, in lines; not allocated where nothing is looked for.
      type(string_t), allocatable :: caution(:)
   end type machine_t

contains

   !> A machine of n coordinates in m, q1 to qn, with these matrices (n, n); nothing acts on it, and it rests at 0.
   function plain_machine(mass, damping, stiffness) result(machine)
      real(wp), intent(in) :: mass(:, :), damping(:, :), stiffness(:, :)
      type(machine_t) :: machine

      integer :: i, n

      n = size(mass, 1)
      machine%title = ""
      allocate (machine%coordinate(n), machine%unit(n), machine%rate_unit(n))
      write (machine%coordinate, "(a, i0)") ("q", i, i=1, n)
      machine%unit = "m"
      machine%rate_unit = "m/s"
      machine%mass = mass
      machine%damping = damping
      machine%stiffness = stiffness
      allocate (machine%load(n), machine%displacement(n), machine%velocity(n), source=0.0_wp)
      allocate (machine%tone(0), machine%harmonic_load(n, 0), machine%contact(0), machine%observable(0))
   end function plain_machine

   !> The motions of a machine that stretch none of its `springs` (n, springs) and `dampers` (n, dampers), directions of elements.
   subroutine find_free_motions(machine, springs, dampers)
      type(machine_t), intent(inout) :: machine
      real(wp), intent(in) :: springs(:, :), dampers(:, :)

      real(wp), allocatable :: of_damping(:, :)
      integer :: info

      ! Without singular values nothing is known to be free.
      call null_space(springs, machine%free_of_stiffness, info)
      call null_space(dampers, of_damping, info)
      call intersection_of(machine%free_of_stiffness, of_damping, machine%free_of_both, info)
   end subroutine find_free_motions

   !> Add a contact on wᵀq, m, with this law.
   subroutine add_contact(machine, name, w, law)
      type(machine_t), intent(inout) :: machine
      character(*), intent(in) :: name
      real(wp), intent(in) :: w(:)
      class(contact_law_t), intent(in) :: law

      type(contact_t), allocatable :: all(:)
      integer :: j, n

      n = size(machine%contact)
      allocate (all(n + 1))
      do j = 1, n
         all(j) = machine%contact(j)
      end do
      associate (contact => all(n + 1))
         contact%name = name
         contact%unit = "m"
         contact%force_unit = "N"
         contact%w = w
         allocate (contact%law, source=law)
         allocate (contact%error(size(machine%tone)), source=(0.0_wp, 0.0_wp))
      end associate
      call move_alloc(all, machine%contact)
   end subroutine add_contact

   !> Observe aᵀq + bᵀq'.
   subroutine add_observable(machine, name, unit, a, b)
      type(machine_t), intent(inout) :: machine
      character(*), intent(in) :: name, unit
      real(wp), intent(in) :: a(:), b(:)

      type(observable_t) :: observable

      observable%name = name
      observable%unit = unit
      observable%long_name = name
      observable%on_displacement = a
      observable%on_velocity = b
      allocate (observable%error(size(machine%tone)), source=(0.0_wp, 0.0_wp))
      machine%observable = [machine%observable, observable]
   end subroutine add_observable

   !> All rows of the displacements by which contacts feel the coordinates (n, rows).
   pure function contact_rows(contact) result(rows)
      type(contact_t), intent(in) :: contact(:)
      real(wp), allocatable :: rows(:, :)

      integer :: j

      allocate (rows(0, 0))
      if (size(contact) > 0) rows = reshape([(contact(j)%w, j=1, size(contact))], [size(contact(1)%w), size(contact)])
      do j = 1, size(contact)
         if (.not. allocated(contact(j)%frame)) cycle
         rows = reshape([rows, contact(j)%frame%across, contact(j)%frame%spin], [size(rows, 1), size(rows, 2) + 2])
      end do
   end function contact_rows

   !> Whether a contact is a ring.
   elemental logical function is_ring(contact)
      type(contact_t), intent(in) :: contact

      is_ring = .false.
      if (allocated(contact%frame)) is_ring = contact%frame%tone == 0 .and. .not. contact%law%of_normal
   end function is_ring

   !> s of a contact at the displacements q (n) without excitation, in a frame that turns at the phase 0, its slope by them, and the
   !> direction across that in a plane (n each).
   pure subroutine stretch_of(contact, q, s, slope, turned)
      type(contact_t), intent(in) :: contact
      real(wp), intent(in) :: q(:)
      real(wp), intent(out) :: s
      real(wp), intent(out), optional :: slope(:), turned(:)

      real(wp) :: d(2), n(2)

      s = dot_product(contact%w, q) + contact%offset
      if (present(slope)) slope = contact%w
      if (present(turned)) turned = 0.0_wp
      if (.not. allocated(contact%frame)) return
      if (contact%frame%tone > 0) return
      d = [s, dot_product(contact%frame%across, q)] - contact%frame%centre
      n = outward(d, [0.0_wp, 0.0_wp])
      s = norm2(d)
      if (present(slope)) slope = n(1)*contact%w + n(2)*contact%frame%across
      if (present(turned)) turned = n(2)*contact%w - n(1)*contact%frame%across
   end subroutine stretch_of

   !> The direction in which a contact acts at the displacements q (n each), with these phasors (tones).
   pure function push_of(contact, q, phasor) result(w)
      type(contact_t), intent(in) :: contact
      real(wp), intent(in) :: q(:)
      complex(wp), intent(in) :: phasor(:)
      real(wp) :: w(size(q))

      complex(wp) :: at
      real(wp) :: s, turned(size(q))

      call stretch_of(contact, q, s, w, turned)
      if (.not. allocated(contact%frame)) return
      if (contact%law%of_normal) w = turned + contact%frame%spin
      if (contact%frame%tone == 0) return
      at = contact%frame%phase*phasor(contact%frame%tone)
      w = at%re*contact%w + at%im*contact%frame%across
   end function push_of

   !> Whether two machines differ in excitation, clearances and start only, so that the same modes serve both; those whose matrices
   !> change with time count as different.
   pure function same_structure(a, b) result(same)
      type(machine_t), intent(in) :: a, b
      logical :: same

      integer :: j

      same = same_at_rest(a, b) .and. .not. (allocated(a%by_speed) .or. allocated(b%by_speed))
      if (.not. same) return
      same = equal(a%damping, b%damping) .and. size(a%contact) == size(b%contact) .and. size(a%observable) == size(b%observable)
      do j = 1, size(a%contact)
         if (.not. same) return
         same = same_slopes(a%contact(j)%law, b%contact(j)%law) &
                .and. equal(contact_rows(a%contact(j:j)), contact_rows(b%contact(j:j)))
         same = same .and. a%contact(j)%normal_of == b%contact(j)%normal_of .and. a%contact(j)%only_with == b%contact(j)%only_with &
                .and. .not. abs(a%contact(j)%drive - b%contact(j)%drive) > 0.0_wp &
                .and. .not. abs(a%contact(j)%drive_rate - b%contact(j)%drive_rate) > 0.0_wp
      end do
      do j = 1, size(a%observable)
         if (.not. same) return
         same = same_observable(a%observable(j), b%observable(j))
      end do
   end function same_structure

   !> What is wrong with a mass matrix whose leading minor of order `at` is not positive.
   pure function mass_complaint(machine, at) result(text)
      type(machine_t), intent(in) :: machine
      integer, intent(in) :: at
      character(:), allocatable :: text

      text = "the mass matrix is not positive definite: '"//trim(machine%coordinate(at))// &
             "' has no mass, or too little beside that of others"
   end function mass_complaint

   pure function same_observable(a, b) result(same)
      type(observable_t), intent(in) :: a, b
      logical :: same

      same = a%kind == b%kind .and. a%contact == b%contact
      if (.not. same .or. a%kind /= observe_linear) return
      same = .not. (any(abs(a%on_displacement - b%on_displacement) > 0.0_wp) &
                    .or. any(abs(a%on_velocity - b%on_velocity) > 0.0_wp))
   end function same_observable

   !> Whether two machines, if there are two, have the same masses and springs.
   pure logical function same_at_rest(a, b) result(same)
      type(machine_t), intent(in) :: a, b

      same = allocated(a%mass) .and. allocated(b%mass)
      if (same) same = equal(a%mass, b%mass) .and. equal(a%stiffness, b%stiffness)
   end function same_at_rest

   pure function equal(a, b)
      real(wp), intent(in) :: a(:, :), b(:, :)
      logical :: equal

      equal = size(a) == size(b)
      if (equal) equal = .not. any(abs(a - b) > 0.0_wp)
   end function equal

end module razy_machine_machine
