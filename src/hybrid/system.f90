!! The machine in the coordinates that its contacts and observables feel (razy_machine_coupled):
!!
!!     y'' + B y' + K y = S f(t) - Σ_j w_j F_j(s_j, s_j'),   s_j = w_jᵀ y + c_j + Re(Σ_t e_jt E_t),   z = (y, y').
!!
!! Made once for a machine and shared by all that follows its motion. Of a machine that differs from the one before in loads,
!! clearances and start only, the coordinates are kept. What no contact feels can stand beside: its motion is linear.
module razy_hybrid_system
   use razy_core_error, only: error_t
   use razy_core_kinds, only: wp
   use razy_core_tone, only: rate_of
   use razy_hybrid_linear_form, only: linear_form_t, new_form, zero_form
   use razy_linalg_pattern, only: connected_sets, find_profile
   use razy_machine_coupled, only: coupled_t, new_coupled
   use razy_machine_frame, only: frame_t
   use razy_machine_free_motions, only: free_motions_t, new_free_motions
   use razy_machine_machine, only: machine_t, observe_linear, same_at_rest, same_structure
   implicit none(type, external)
   private

   public :: system_t

   type :: system_t
      type(machine_t) :: machine
      type(coupled_t) :: coupled
      !> Its motions without stiffness and damping, by structure.
      type(free_motions_t) :: free
      !> Coupled coordinates; z has 2m components.
      integer :: m = 0
      !> Whether every coordinate is followed, not only those that contacts and observables feel.
      logical :: keep_all = .false.
      !> Whether it is one of many with other values, so that what is linked to what is felt is followed as well.
      logical :: linked = .false.
      !> Whether what no contact feels is followed beside.
      logical :: apart = .false.
      !> Whether contacts can hold constraints: closed rigid stops, friction that sticks.
      logical :: constrained = .false.
      !> Number of the machine, and of the machine with other coordinates than the one before.
      integer :: version = 0, structure = 0
      !> Contact directions (m, contacts), constant load S f (m), its phasors (m, tones), frequencies (tones), rad/s.
      real(wp), allocatable :: w(:, :), load(:), omega(:)
      complex(wp), allocatable :: harmonic(:, :)
      !> Those with which phasors E turn, and those of waveforms, E = u + i u'/ω, which do not (tones).
      real(wp), allocatable :: turning(:), slope(:)
      !> What is observed and no contact feels, if it is followed beside, with its load and phasors. Arrays stand between parts of
      !> one type, since gfortran 12 may free the first of neighbours alone.
      type(coupled_t) :: beside
      type(free_motions_t) :: free_beside
      real(wp), allocatable :: load_beside(:)
      complex(wp), allocatable :: harmonic_beside(:, :)
      !> The largest of the frequencies, rad/s.
      real(wp) :: fastest = 0.0_wp
      !> Frames of contacts in a plane (contacts), with their rows in these coordinates; whether there is one. Lengths of what each
      !> contact feels (contacts).
      type(frame_t), allocatable :: frame(:)
      logical :: curved = .false.
      real(wp), allocatable :: reach(:)
      !> Variables s of the contacts (contacts), and observables (observables; 0 for the force of a contact).
      type(linear_form_t), allocatable :: gap(:), observed(:)
      !> Whether contacts move, or are moved, whatever the bodies do (contacts).
      logical, allocatable :: given(:)
      !> What observables feel of the motion beside (observables), and whether they do.
      type(linear_form_t), allocatable :: beyond(:)
      logical, allocatable :: is_beyond(:)
      !> First and last row that matter in each column of B and K (m each).
      integer, allocatable :: first(:), last(:)
      !> Coordinates that elements or contacts couple have one number (m), from 1; that of what each contact feels (contacts).
      integer, allocatable :: set(:), feels(:)
   contains
      procedure :: take
      procedure :: contact_form
      procedure :: first_state
      procedure :: first_beside
      procedure :: from_coordinates
      procedure :: to_coordinates
   end type system_t

contains

   !> Take a machine; `keep_all` follows every coordinate; what no contact feels stands beside if it is to be `apart`.
   subroutine take(self, machine, keep_all, apart, error)
      class(system_t), intent(inout) :: self
      type(machine_t), intent(in) :: machine
      logical, intent(in) :: keep_all, apart
      type(error_t), allocatable, intent(out) :: error

      real(wp), allocatable :: pressed(:, :)
      integer :: j
      logical :: as_before, known

      as_before = same_at_rest(self%machine, machine)
      known = same_structure(self%machine, machine) .and. (self%keep_all .eqv. keep_all) .and. (self%apart .eqv. apart)
      self%machine = machine
      self%keep_all = keep_all
      self%apart = apart
      self%version = self%version + 1
      if (.not. known) then
         self%structure = self%structure + 1
         if (apart) then
            call new_coupled(self%coupled, machine, keep_all, error, self%beside, as_before=as_before)
         else
            self%beside%m = 0
            call new_coupled(self%coupled, machine, keep_all, error, linked=self%linked, as_before=as_before)
         end if
         if (allocated(error)) then
            ! No machine is like one that could not be taken.
            deallocate (self%machine%mass)
            return
         end if
         self%m = self%coupled%m
         ! gfortran 12 leaves a vector longer than the product that is assigned to it.
         if (allocated(self%load)) deallocate (self%load)
         if (allocated(self%load_beside)) deallocate (self%load_beside)
         call new_free_motions(self%free, machine, self%coupled)
         if (self%beside%m > 0) call new_free_motions(self%free_beside, machine, self%beside)
         call find_profile(self%coupled%stiffness, self%coupled%damping, self%first, self%last)
         if (allocated(self%w)) deallocate (self%w)
         allocate (self%w(self%m, size(machine%contact)))
         do j = 1, size(machine%contact)
            self%w(:, j) = matmul(self%coupled%project, machine%contact(j)%w)
         end do
         self%constrained = any([(any(machine%contact(j)%law%branch%constraint), j=1, size(machine%contact))])
         ! Directions that turn, and matrices that change with the speed, couple more than is seen here.
         pressed = abs(self%w)
         do j = 1, size(machine%contact)
            if (machine%contact(j)%normal_of > 0) pressed(:, j) = pressed(:, j) + abs(self%w(:, machine%contact(j)%normal_of))
         end do
         self%set = connected_sets(abs(self%coupled%stiffness) + abs(self%coupled%damping) &
                                   + matmul(pressed, transpose(pressed)) > 0.0_wp .or. allocated(self%coupled%by_speed) &
                                   .or. any([(allocated(machine%contact(j)%frame), j=1, size(machine%contact))]))
         self%feels = self%set(maxloc(abs(self%w), dim=1))
      end if
      call take_frames(self)
      self%load = matmul(self%coupled%project, machine%load)
      self%harmonic = matmul(self%coupled%project, machine%harmonic_load)
      if (self%beside%m > 0) then
         self%load_beside = matmul(self%beside%project, machine%load)
         self%harmonic_beside = matmul(self%beside%project, machine%harmonic_load)
      end if
      self%omega = machine%tone%omega
      self%slope = merge(self%omega, 0.0_wp, machine%tone%ramps())
      self%turning = self%omega - self%slope
      self%fastest = maxval([0.0_wp, self%omega])
      if (allocated(self%gap)) deallocate (self%gap, self%observed, self%beyond, self%is_beyond)
      allocate (self%gap(size(machine%contact)), self%observed(size(machine%observable)))
      self%given = abs(machine%contact%drive) > 0.0_wp .or. abs(machine%contact%drive_rate) > 0.0_wp
      do j = 1, size(self%gap)
         self%gap(j) = self%contact_form(j, 1.0_wp, 0.0_wp, 0.0_wp)
         self%given(j) = self%given(j) .or. any(abs(self%gap(j)%error) > 0.0_wp)
      end do
      do j = 1, size(self%observed)
         associate (observable => machine%observable(j), project => self%coupled%project)
            self%observed(j) = zero_form(self%m, size(self%omega))
            if (observable%kind /= observe_linear) cycle
            self%observed(j) = new_form(matmul(project, observable%on_displacement), matmul(project, observable%on_velocity), &
                                        observable%constant, observable%error)
         end associate
      end do
      call look_beyond(self)
   end subroutine take

   !> Frames of the contacts, and how far each feels the coordinates.
   pure subroutine take_frames(self)
      class(system_t), intent(inout) :: self

      integer :: j

      self%reach = norm2(self%w, dim=1)
      if (allocated(self%frame)) deallocate (self%frame)
      allocate (self%frame(size(self%reach)))
      self%curved = .false.
      do j = 1, size(self%reach)
         if (.not. allocated(self%machine%contact(j)%frame)) cycle
         self%curved = .true.
         associate (frame => self%machine%contact(j)%frame, project => self%coupled%project)
            self%frame(j) = frame_t(matmul(project, frame%across), matmul(project, frame%spin), frame%centre, &
                                    frame%tone, frame%phase)
            self%reach(j) = norm2([self%w(:, j), self%frame(j)%across, self%frame(j)%spin])
         end associate
      end do
   end subroutine take_frames

   !> What observables feel of the motion beside. Less than `negligible` of what they feel in all is rounding of the projection.
   pure subroutine look_beyond(self)
      class(system_t), intent(inout) :: self

      real(wp), parameter :: negligible = 1.0e-13_wp
      real(wp) :: all_of_it
      integer :: j

      allocate (self%beyond(size(self%observed)))
      allocate (self%is_beyond(size(self%observed)), source=.false.)
      if (self%beside%m == 0) return
      do j = 1, size(self%observed)
         self%beyond(j) = zero_form(self%beside%m, 0)
         associate (observable => self%machine%observable(j), beyond => self%beyond(j), project => self%beside%project)
            if (observable%kind /= observe_linear) cycle
            beyond%on_y = matmul(project, observable%on_displacement)
            beyond%on_v = matmul(project, observable%on_velocity)
            all_of_it = norm2([beyond%on_y, self%observed(j)%on_y]) + norm2([beyond%on_v, self%observed(j)%on_v])
            self%is_beyond(j) = norm2(beyond%on_y) + norm2(beyond%on_v) > negligible*all_of_it
         end associate
      end do
   end subroutine look_beyond

   !> alpha s + beta s' + gamma of contact j.
   pure function contact_form(self, j, alpha, beta, gamma) result(form)
      class(system_t), intent(in) :: self
      integer, intent(in) :: j
      real(wp), intent(in) :: alpha, beta, gamma
      type(linear_form_t) :: form

      associate (contact => self%machine%contact(j))
         form = new_form(alpha*self%w(:, j), beta*self%w(:, j), alpha*contact%offset + beta*contact%drive + gamma, &
                         alpha*contact%error + beta*rate_of(self%machine%tone, contact%error))
      end associate
   end function contact_form

   !> z (2m) at the time 0.
   pure function first_state(self) result(z)
      class(system_t), intent(in) :: self
      real(wp) :: z(2*self%m)

      z = self%from_coordinates(self%machine%displacement, self%machine%velocity)
   end function first_state

   !> z (2m) of displacements and velocities (n each), without what is rounding: bodies that move alike do not move apart.
   pure function from_coordinates(self, displacement, velocity) result(z)
      class(system_t), intent(in) :: self
      real(wp), intent(in) :: displacement(:), velocity(:)
      real(wp) :: z(2*self%m)

      z = [matmul(self%coupled%to_coupled, displacement), matmul(self%coupled%to_coupled, velocity)]
      associate (size_of => abs(self%coupled%to_coupled))
         where (abs(z) <= 4*size(displacement)*epsilon(1.0_wp)*[matmul(size_of, abs(displacement)), &
                                                                matmul(size_of, abs(velocity))]) z = 0.0_wp
      end associate
   end function from_coordinates

   !> The state (2 m) of the motion beside at the time 0.
   pure function first_beside(self) result(z)
      class(system_t), intent(in) :: self
      real(wp) :: z(2*self%beside%m)

      z(:self%beside%m) = matmul(self%beside%to_coupled, self%machine%displacement)
      z(self%beside%m + 1:) = matmul(self%beside%to_coupled, self%machine%velocity)
   end function first_beside

   !> Displacements and velocities (n each) of z and of the state `beside`, if there is one; needs a machine taken with `keep_all`.
   pure subroutine to_coordinates(self, z, displacement, velocity, beside)
      class(system_t), intent(in) :: self
      real(wp), intent(in) :: z(:)
      real(wp), intent(out) :: displacement(:), velocity(:)
      real(wp), intent(in), optional :: beside(:)

      displacement = matmul(z(:self%m), self%coupled%project)
      velocity = matmul(z(self%m + 1:), self%coupled%project)
      if (.not. present(beside) .or. self%beside%m == 0) return
      displacement = displacement + matmul(beside(:self%beside%m), self%beside%project)
      velocity = velocity + matmul(beside(self%beside%m + 1:), self%beside%project)
   end subroutine to_coordinates

end module razy_hybrid_system
