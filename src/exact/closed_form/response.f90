!! The closed form of the motion in one contact state under given excitation.
!!
!! All parts of the motion that vary in time stand in one list: exponential terms of the modes and, after them, one term for
!! each tone of excitation, whose amplitude is e^{iω_t t} itself. Every linear form of the state and every derivative of it is
!! then a row of coefficients on these amplitudes, plus those on rigid modes and dense parts. Terms that are followed together
!! with their excitation (razy_exact_closed_form_driven) are the last of the terms; where a constant force acts on them, it is
!! one more tone, of frequency 0. A tone that is a straight line u has the amplitude u + i u'/ω and the exponent 0; its real part
!! grows by ω times the imaginary one. Rigid modes that such a one pushes are followed in a dense part.
module razy_exact_closed_form_response
   use razy_core_kinds, only: i8, wp
   use razy_exact_closed_form_dense_part, only: dense_part_t, new_dense_part
   use razy_exact_closed_form_driven, only: driven_t, find_driven, new_driven
   use razy_exact_modal_basis, only: dense_modes_t, modal_basis_t
   use razy_linalg_blocks, only: filled, paired
   use razy_linalg_dense, only: felt
   implicit none(type, external)
   private

   public :: new_response, response_t
   public :: coarsest_level, finest_level, many

   !> Search steps are 2^-level seconds.
   integer, parameter :: coarsest_level = -30, finest_level = 70
   !> From this number of terms on a model is large.
   integer, parameter :: many = 12

   type :: response_t
      integer :: m = 0, terms = 0, tones = 0, rigid = 0, nx = 0
      !> terms + tones, and one for a constant force on driven terms.
      integer :: amplitudes = 0
      !> Length of lists of amplitudes filled up with zeros to pairs, and of the list of all of the motion but dense states
      !> (razy_exact_closed_form_amplitudes), in which the constant 1 has this place.
      integer :: filled = 0, length = 0, one = 0
      !> The first numbers of the list, on which the state depends; those that depend on the state: real parts of terms, their
      !> imaginary parts, rigid modes, their rates.
      integer :: columns = 0, rows = 0
      type(driven_t) :: driven
      !> Exponents of all amplitudes (amplitudes); their real and imaginary parts and moduli (filled).
      complex(wp), allocatable :: exponent(:)
      real(wp), allocatable :: decay(:), turn(:), modulus(:)
      !> Largest modulus of an exponent or of the rates in a dense part, 1/s.
      real(wp) :: fastest = 0.0_wp
      !> The largest of those at which rounding grows in time, 1/s: what decays without a turn loses none.
      real(wp) :: turning = 0.0_wp
      logical :: growing = .false.
      !> ω of the tones that are straight lines, 1/s, 0 of the others (tones); whether there are any.
      real(wp), allocatable :: slope(:)
      logical :: ramps = .false.
      !> No term is driven and no part dense; nor does any amplitude grow.
      logical :: plain = .true., bounded = .true.
      !> Level of steps on which the fastest amplitude turns by less than 0.05.
      integer :: fine_level = 0
      !> On the list x: z = from x and dense parts (2m, columns), and of z without constant and tones into z (rows, 2m).
      real(wp), allocatable :: from(:, :), into(:, :)
      !> Where the coordinates of the closed form count from (2m): z = origin + from x.
      real(wp), allocatable :: origin(:)
      !> Moduli of what is from amplitudes, 1, rigid modes and rates to the state, and back to terms, rigid modes and rates (2m,
      !> amplitudes + 1 + 2 rigid; terms + 2 rigid, 2m), made when they are asked for.
      real(wp), allocatable :: from_size(:, :), to_size(:, :)
      !> Lengths of the modes and of the rows that give amplitudes, displacements and velocities apart; in column 0 of the first
      !> that of the constant (2, 0:amplitudes; 2, terms).
      real(wp), allocatable :: from_length(:, :), to_length(:, :)
      !> Rigid modes (m, rigid) and the constant force on each.
      real(wp), allocatable :: rigid_mode(:, :), rigid_force(:)
      type(dense_part_t), allocatable :: dense(:)
      !> First dense state of each part, and one beyond the last.
      integer, allocatable :: first(:)
      !> Factors of the amplitudes over steps of 2^-level s, made when first used: real and imaginary parts (2 filled, level).
      real(wp), allocatable :: factor(:, :)
      !> What cosines and sines of all tones add to driven terms in such a step (terms, 2 tones, level).
      real(wp), allocatable :: push_re(:, :, :), push_im(:, :, :)
      !> Dense step matrices (nx, nx, level), block diagonal.
      real(wp), allocatable :: step_dense(:, :, :)
      logical :: has_step(coarsest_level:finest_level) = .false.
      real(wp) :: step_length(coarsest_level:finest_level) = 0.0_wp
   contains
      procedure :: numbers
   end type response_t

contains

   !> The response of modes `basis` to the constant force `load` (m) and phasors `harmonic` (m, tones); `flies`: after an impact.
   !> Phasors turn with `omega`; those with a `slope` that is not 0 are straight lines (tones). With an `origin` (m) the load is
   !> what acts at rest there.
   pure subroutine new_response(self, basis, flies, load, harmonic, omega, slope, origin)
      type(response_t), intent(out) :: self
      type(modal_basis_t), intent(in) :: basis
      logical, intent(in) :: flies
      real(wp), intent(in) :: load(:), omega(:), slope(:)
      complex(wp), intent(in) :: harmonic(:, :)
      real(wp), intent(in), optional :: origin(:)

      integer :: t

      allocate (self%origin(2*basis%m), source=0.0_wp)
      if (present(origin)) self%origin(:basis%m) = origin
      if (any([(slope(t) > 0.0_wp .and. any(abs(matmul(harmonic(:, t), basis%rigid)) > 0.0_wp), t=1, size(omega))])) then
         call respond(self, without_rigid(basis), flies, load, harmonic, omega, slope)
      else
         call respond(self, basis, flies, load, harmonic, omega, slope)
      end if
   end subroutine new_response

   !> The same modes, rigid ones as a dense part.
   pure function without_rigid(basis) result(other)
      type(modal_basis_t), intent(in) :: basis
      type(modal_basis_t) :: other

      type(dense_modes_t) :: part

      associate (r => size(basis%rigid, 2))
         part%phi = basis%rigid
         allocate (part%stiffness(r, r), part%damping(r, r), source=0.0_wp)
      end associate
      other = basis
      other%dense = [basis%dense, part]
      other%rigid = basis%rigid(:, :0)
   end function without_rigid

   pure subroutine respond(self, basis, flies, load, harmonic, omega, slope)
      type(response_t), intent(inout) :: self
      type(modal_basis_t), intent(in) :: basis
      logical, intent(in) :: flies
      real(wp), intent(in) :: load(:), omega(:), slope(:)
      complex(wp), intent(in) :: harmonic(:, :)

      complex(wp) :: particular(2*basis%m), force
      integer :: i, m, n, order(size(basis%lambda)), t

      m = basis%m
      self%slope = slope
      self%ramps = any(slope > 0.0_wp)
      call sort_terms(self, basis, flies, load, harmonic, omega, order)
      self%m = m
      self%terms = size(basis%lambda)
      self%tones = size(omega)
      self%rigid = size(basis%rigid, 2)
      n = self%terms + max(self%tones, self%driven%tones)
      self%amplitudes = n
      call shape_lists(self)
      self%exponent = [basis%lambda(order), (cmplx(0.0_wp, omega(t), wp), t=1, self%tones), &
                       ((0.0_wp, 0.0_wp), i=self%terms + self%tones + 1, n)]
      self%decay = [real(self%exponent), (0.0_wp, i=n + 1, self%filled)]
      self%turn = [aimag(self%exponent), (0.0_wp, i=n + 1, self%filled)]
      self%modulus = [abs(self%exponent), (0.0_wp, i=n + 1, self%filled)]
      self%growing = any(real(basis%lambda) > 0.0_wp)
      associate (f => self%filled, r => self%rigid, one => self%one)
         do i = 1, self%terms
            self%from(:, i) = real(basis%from_term(:, order(i)))
            self%from(:, f + i) = -aimag(basis%from_term(:, order(i)))
            self%into(i, :) = real(basis%to_term(order(i), :))
            self%into(self%terms + i, :) = aimag(basis%to_term(order(i), :))
            if (i > self%driven%first) cycle
            force = felt(basis%to_term(order(i), m + 1:), cmplx(load, kind=wp))
            if (.not. abs(force) > 0.0_wp) cycle
            self%from(:, one) = self%from(:, one) - real(basis%from_term(:, order(i))*(force/basis%lambda(order(i))))
         end do
         do t = 1, self%tones
            if (slope(t) > 0.0_wp) then
               particular = ramp_state(basis, order(:self%driven%first), harmonic(:, t), slope(t))
            else
               particular = harmonic_state(basis, order(:self%driven%first), harmonic(:, t), omega(t))
            end if
            self%from(:, self%terms + t) = real(particular)
            self%from(:, f + self%terms + t) = -aimag(particular)
         end do
         self%from(:m, one + 1:one + r) = basis%rigid
         self%from(m + 1:, one + r + 1:one + 2*r) = basis%rigid
         self%into(2*self%terms + 1:2*self%terms + r, :m) = transpose(basis%rigid)
         self%into(2*self%terms + r + 1:, m + 1:) = transpose(basis%rigid)
      end associate
      call measure_lengths(self)
      self%rigid_mode = basis%rigid
      self%rigid_force = [(felt(load, basis%rigid(:, i)), i=1, self%rigid)]
      if (self%driven%count > 0) allocate (self%push_re(self%driven%count, 2*self%driven%tones, coarsest_level:finest_level), &
                                           self%push_im(self%driven%count, 2*self%driven%tones, coarsest_level:finest_level))
      call add_dense_parts(self, basis, load, harmonic, omega)
      self%fastest = maxval([0.0_wp, self%modulus, self%dense%norm])
      self%turning = basis%fastest
      if (basis%stiff) self%turning = turning_rate(self)
      self%plain = self%nx == 0 .and. self%driven%count == 0
      self%bounded = self%plain .and. .not. (self%growing .or. self%ramps)
      self%fine_level = min(max(exponent(20*self%fastest), coarsest_level), finest_level)
   end subroutine respond

   !> Room for the matrices between the state and the list of a motion, and for the factors of steps.
   pure subroutine shape_lists(self)
      type(response_t), intent(inout) :: self

      self%filled = paired(self%amplitudes)
      self%one = 2*self%filled + 1
      self%length = filled(self%one + 3*self%rigid)
      self%columns = self%one + 2*self%rigid
      self%rows = 2*(self%terms + self%rigid)
      allocate (self%from(2*self%m, self%columns), self%into(self%rows, 2*self%m), source=0.0_wp)
      ! In free flight there is no factor, and a place all the same.
      allocate (self%factor(max(2*self%filled, 1), coarsest_level:finest_level))
   end subroutine shape_lists

   pure subroutine measure_lengths(self)
      type(response_t), intent(inout) :: self

      integer :: k

      associate (m => self%m, f => self%filled, from => self%from, into => self%into)
         allocate (self%from_length(2, 0:self%amplitudes), self%to_length(2, self%terms))
         self%from_length(:, 0) = [norm2(from(:m, self%one)) + norm2(self%origin(:m)), norm2(from(m + 1:, self%one))]
         do k = 1, self%amplitudes
            self%from_length(:, k) = [hypot(norm2(from(:m, k)), norm2(from(:m, f + k))), &
                                      hypot(norm2(from(m + 1:, k)), norm2(from(m + 1:, f + k)))]
         end do
         do k = 1, self%terms
            self%to_length(:, k) = [hypot(norm2(into(k, :m)), norm2(into(self%terms + k, :m))), &
                                    hypot(norm2(into(k, m + 1:)), norm2(into(self%terms + k, m + 1:)))]
         end do
      end associate
   end subroutine measure_lengths

   !> The largest modulus of an exponent that is not real, or norm of a dense part.
   pure function turning_rate(self) result(rate)
      type(response_t), intent(in) :: self
      real(wp) :: rate

      rate = maxval([0.0_wp, pack(self%modulus, abs(self%turn) > 0.0_wp .or. self%decay > 0.0_wp), self%dense%norm])
   end function turning_rate

   !> The order of the terms, driven ones last, and these.
   pure subroutine sort_terms(self, basis, flies, load, harmonic, omega, order)
      type(response_t), intent(inout) :: self
      type(modal_basis_t), intent(in) :: basis
      logical, intent(in) :: flies
      real(wp), intent(in) :: load(:), omega(:)
      complex(wp), intent(in) :: harmonic(:, :)
      integer, intent(out) :: order(:)

      logical :: driven(size(order))
      integer :: i, plain

      call find_driven(basis, flies, load, harmonic, omega, self%slope, driven)
      plain = count(.not. driven)
      order(:plain) = pack([(i, i=1, size(order))],.not. driven)
      order(plain + 1:) = pack([(i, i=1, size(order))], driven)
      call new_driven(self%driven, basis, order(plain + 1:), plain, load, harmonic, omega, self%slope)
   end subroutine sort_terms

   pure subroutine add_dense_parts(self, basis, load, harmonic, omega)
      type(response_t), intent(inout) :: self
      type(modal_basis_t), intent(in) :: basis
      real(wp), intent(in) :: load(:), omega(:)
      complex(wp), intent(in) :: harmonic(:, :)

      integer :: i

      allocate (self%dense(size(basis%dense)))
      self%first = [1]
      do i = 1, size(basis%dense)
         call new_dense_part(self%dense(i), basis%dense(i), load, harmonic, omega, self%slope)
         self%nx = self%nx + size(self%dense(i)%matrix, 1)
         self%first = [self%first, self%nx + 1]
      end do
      if (self%nx > 0) allocate (self%step_dense(self%nx, self%nx, coarsest_level:finest_level))
   end subroutine add_dense_parts

   !> P with z = Re(P E) in the exponential terms `number` under a force Re(F E), E = u + i u'/ω: of a term's amplitude
   !> α u + β u'/ω with λ α = -d0 and λ β = ω α - d1, d0 and d1 what the two parts of the force do to it.
   pure function ramp_state(basis, number, force, omega) result(particular)
      type(modal_basis_t), intent(in) :: basis
      integer, intent(in) :: number(:)
      complex(wp), intent(in) :: force(:)
      real(wp), intent(in) :: omega
      complex(wp) :: particular(2*basis%m)

      complex(wp) :: alpha, beta
      integer :: i

      particular = (0.0_wp, 0.0_wp)
      do i = 1, size(number)
         associate (left => basis%to_term(number(i), basis%m + 1:), lambda => basis%lambda(number(i)), &
                    mode => basis%from_term(:, number(i)))
            alpha = felt(left, cmplx(real(force), kind=wp))
            beta = felt(left, cmplx(aimag(force), kind=wp))
            if (.not. abs(alpha) + abs(beta) > 0.0_wp) cycle
            alpha = -alpha/lambda
            beta = (omega*alpha + beta)/lambda
            particular = particular + cmplx(real(mode*alpha), -real(mode*beta), wp)
         end associate
      end do
   end function ramp_state

   !> P with z = Re(P e^{iωt}) in the exponential terms `number` and rigid modes: (iω - A)⁻¹ (0, force), by modes.
   pure function harmonic_state(basis, number, force, omega) result(particular)
      type(modal_basis_t), intent(in) :: basis
      integer, intent(in) :: number(:)
      complex(wp), intent(in) :: force(:)
      real(wp), intent(in) :: omega
      complex(wp) :: particular(2*basis%m)

      complex(wp) :: drive, mirrored, rigid
      integer :: i, k, m

      m = basis%m
      particular = (0.0_wp, 0.0_wp)
      do i = 1, size(number)
         k = number(i)
         drive = felt(basis%to_term(k, m + 1:), force)
         mirrored = felt(conjg(basis%to_term(k, m + 1:)), force)
         ! Without a force there may be resonance.
         if (.not. max(abs(drive), abs(mirrored)) > 0.0_wp) cycle
         drive = drive/(cmplx(0.0_wp, omega, wp) - basis%lambda(k))
         if (abs(aimag(basis%lambda(k))) > 0.0_wp) then
            mirrored = mirrored/(cmplx(0.0_wp, omega, wp) - conjg(basis%lambda(k)))
            particular = particular + 0.5_wp*(basis%from_term(:, k)*drive + conjg(basis%from_term(:, k))*mirrored)
         else
            particular = particular + basis%from_term(:, k)*drive
         end if
      end do
      do k = 1, size(basis%rigid, 2)
         rigid = -felt(cmplx(basis%rigid(:, k), kind=wp), force)/omega**2
         particular(:m) = particular(:m) + basis%rigid(:, k)*rigid
         particular(m + 1:) = particular(m + 1:) + basis%rigid(:, k)*rigid*cmplx(0.0_wp, omega, wp)
      end do
   end function harmonic_state

   !> Numbers that it holds, in the large arrays.
   elemental integer(i8) function numbers(self)
      class(response_t), intent(in) :: self

      numbers = 0
      if (.not. allocated(self%from)) return
      numbers = size(self%from, kind=i8) + size(self%into) + size(self%factor)
      if (allocated(self%from_size)) numbers = numbers + size(self%from_size) + size(self%to_size)
      if (allocated(self%push_re)) numbers = numbers + 2*size(self%push_re, kind=i8)
      if (allocated(self%step_dense)) numbers = numbers + size(self%step_dense, kind=i8)
   end function numbers

end module razy_exact_closed_form_response
