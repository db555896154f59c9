!! Terms of the closed form that are followed together with the excitation that acts on them.
!!
!! The amplitude of a term obeys a' = λ a + Σ_t (p_t e^{iω_t τ} + q_t e^{-iω_t τ}), with p = l·F/2 and q = l·F*/2 of its left vector
!! l and the phasors F of the forces. A particular solution divides by ±iω - λ, or by λ where a constant force acts, and cancels
!! against the rest of the motion where these are small: at undamped resonance, in slow modes. There the amplitude is
!!
!!     a(τ) = e^{λτ} a(0) + Σ_t (p_t E_t I(iω_t) + q_t E_t* I(-iω_t)),   I(s) = (e^{sτ} - e^{λτ})/(s - λ) = τ e^{λτ} φ((s - λ) τ),
!!
!! φ(x) = (e^x - 1)/x, with E_t = e^{iω_t t} at the start: no digit is lost for any s - λ. A constant force is one of ω = 0.
!! What is a straight line, E = u + i u'/ω, adds (p + q) u' ∫ s e^{λ(τ - s)} ds to that of ω = 0.
module razy_exact_closed_form_driven
   use razy_core_kinds, only: wp
   use razy_exact_modal_basis, only: modal_basis_t
   use razy_linalg_dense, only: felt
   implicit none(type, external)
   private

   public :: driven_t, find_driven, new_driven

   !> Highest derivative of a form that is bounded; those that are formed suffice for the Taylor series of a short time, or of one
   !> shorter still.
   integer, parameter :: highest = 5, formed = 10, formed_shorter = 7

   type :: driven_t
      !> Number of these terms, which come after `first` others; tones that act, a constant force included.
      integer :: count = 0, first = 0, tones = 0
      !> Whether a constant force acts: the last tone.
      logical :: loaded = .false.
      complex(wp), allocatable, private :: lambda(:)
      real(wp), allocatable, private :: omega(:), slope(:)
      !> p and q (terms, tones) and the largest of the sum (terms).
      complex(wp), allocatable, private :: p(:, :), q(:, :)
      real(wp), allocatable, private :: largest(:)
      !> What cosine and sine of a tone add to the derivative of order k of an amplitude (terms, tones, k), and bounds of what
      !> all tones add (terms, k).
      complex(wp), allocatable, private :: on_cosine(:, :, :), on_sine(:, :, :)
      real(wp), allocatable, private :: most(:, :)
      !> The same of forces in whatever direction that a term has a part in: their rounding is some epsilon of that.
      real(wp), allocatable, private :: most_along(:, :)
   contains
      procedure :: push
      procedure :: push_shortly
      procedure :: tabulate_push
      procedure :: add_to_row
   end type driven_t

   !> Slower than this part of the fastest mode a mode is followed with a constant force.
   real(wp), parameter :: slow = 1.0e-6_wp
   !> After impacts: flights that become ever shorter need s to the rounding of the state, and with a particular solution in
   !> which more than a digit cancels it is not known so well.
   real(wp), parameter :: slow_in_flight = 0.3_wp
   !> Nearer than this, relative, to a frequency of excitation a mode is followed with it.
   real(wp), parameter :: near = 1.0e-3_wp, near_in_flight = 0.3_wp
   !> Below this |x| the quotient φ(x) loses more than its series; where two terms less of that do.
   real(wp), parameter :: series_below = 0.5_wp, short_series_below = 0.02_wp

contains

   !> Which terms of a basis are to be followed so under the constant force `load` (m) and phasors `harmonic` (m, tones), more of
   !> them if the motion `flies` after an impact.
   pure subroutine find_driven(basis, flies, load, harmonic, omega, slope, driven)
      type(modal_basis_t), intent(in) :: basis
      logical, intent(in) :: flies
      real(wp), intent(in) :: load(:), omega(:), slope(:)
      complex(wp), intent(in) :: harmonic(:, :)
      logical, intent(out) :: driven(:)

      real(wp) :: slowest, within
      integer :: i, m, t
      logical :: is_slow

      m = basis%m
      slowest = merge(slow_in_flight, slow, flies)*basis%fastest
      within = merge(near_in_flight, near, flies)
      do i = 1, size(driven)
         driven(i) = .false.
         associate (lambda => basis%lambda(i))
            is_slow = abs(lambda) <= slowest
            ! What is slow because it is strongly damped may have a small static displacement all the same.
            if (basis%stiff .and. is_slow .and. .not. abs(aimag(lambda)) > 0.0_wp) then
               is_slow = norm2(abs(basis%from_term(:m, i)))*norm2(abs(basis%to_term(i, m + 1:)))*slowest**2 > abs(lambda)
            end if
            if (is_slow) driven(i) = acts(basis%to_term(i, m + 1:), cmplx(load, kind=wp))
            do t = 1, size(omega)
               if (driven(i)) exit
               ! Beside a term that is slower than a straight line is steep, more than its own size cancels.
               if (.not. is_slow .and. abs(cmplx(0.0_wp, omega(t), wp) - lambda) > max(within*omega(t), slope(t))) cycle
               driven(i) = acts(basis%to_term(i, m + 1:), harmonic(:, t))
            end do
         end associate
      end do
   end subroutine find_driven

   !> Whether a force acts on a term.
   pure function acts(left, phasor)
      complex(wp), intent(in) :: left(:), phasor(:)
      logical :: acts

      acts = abs(felt(left, phasor)) > 0.0_wp .or. abs(felt(left, conjg(phasor))) > 0.0_wp
   end function acts

   !> The terms with the numbers `number` of a basis, which will come after `first` others.
   pure subroutine new_driven(self, basis, number, first, load, harmonic, omega, slope)
      type(driven_t), intent(out) :: self
      type(modal_basis_t), intent(in) :: basis
      integer, intent(in) :: number(:), first
      real(wp), intent(in) :: load(:), omega(:), slope(:)
      complex(wp), intent(in) :: harmonic(:, :)

      real(wp), allocatable :: along(:, :)
      integer :: i, m, n, t

      m = basis%m
      n = size(number)
      self%count = n
      self%first = first
      if (n == 0) return
      self%loaded = any(abs(load) > 0.0_wp)
      self%omega = omega
      self%slope = slope
      if (self%loaded) self%omega = [omega, 0.0_wp]
      if (self%loaded) self%slope = [slope, 0.0_wp]
      self%tones = size(self%omega)
      self%lambda = basis%lambda(number)
      allocate (self%p(n, self%tones), self%q(n, self%tones), along(n, self%tones))
      associate (left => basis%to_term(number, m + 1:))
         do t = 1, size(omega)
            do i = 1, n
               self%p(i, t) = 0.5_wp*felt(left(i, :), harmonic(:, t))
               self%q(i, t) = 0.5_wp*felt(left(i, :), conjg(harmonic(:, t)))
            end do
         end do
         if (self%loaded) self%p(:, self%tones) = [(0.5_wp*felt(left(i, :), cmplx(load, kind=wp)), i=1, n)]
         if (self%loaded) self%q(:, self%tones) = self%p(:, self%tones)
         do i = 1, n
            associate (felt => abs(left(i, :)) > 0.0_wp)
               do t = 1, size(omega)
                  along(i, t) = norm2(abs(left(i, :)))*norm2(pack(abs(harmonic(:, t)), felt))
               end do
               if (self%loaded) along(i, self%tones) = norm2(abs(left(i, :)))*norm2(pack(load, felt))
            end associate
         end do
      end associate
      self%largest = sum(abs(self%p) + abs(self%q), dim=2)
      call find_derivatives(self, along)
   end subroutine new_driven

   !> a^(k) = λ^k a + Σ_t (p h_k(iω) e^{iωt} + q h_k(-iω) e^{-iωt}), h_0 = 0, h_k(s) = λ h_(k-1)(s) + s^(k-1).
   !> `along` (terms, tones): the sizes of force and term, whose product the force on the term is not above.
   pure subroutine find_derivatives(self, along)
      type(driven_t), intent(inout) :: self
      real(wp), intent(in) :: along(:, :)

      complex(wp) :: ramp, s, plus, minus
      real(wp) :: bound
      integer :: i, k, t

      allocate (self%most(self%count, highest), self%most_along(self%count, highest), source=0.0_wp)
      allocate (self%on_cosine(self%count, self%tones, formed), self%on_sine(self%count, self%tones, formed))
      do t = 1, self%tones
         s = cmplx(0.0_wp, self%omega(t), wp)
         do i = 1, self%count
            plus = (0.0_wp, 0.0_wp)
            minus = (0.0_wp, 0.0_wp)
            bound = 0.0_wp
            do k = 1, formed
               ramp = self%slope(t)*(self%p(i, t) + self%q(i, t))*plus
               plus = self%lambda(i)*plus + s**(k - 1)
               minus = self%lambda(i)*minus + (-s)**(k - 1)
               self%on_cosine(i, t, k) = self%p(i, t)*plus + self%q(i, t)*minus
               self%on_sine(i, t, k) = (0.0_wp, 1.0_wp)*(self%p(i, t)*plus - self%q(i, t)*minus) + ramp
               if (k > highest) cycle
               bound = abs(self%lambda(i))*bound + (self%omega(t) + self%slope(t))**(k - 1)
               self%most(i, k) = self%most(i, k) + bound*(abs(self%p(i, t)) + abs(self%q(i, t)))
               self%most_along(i, k) = self%most_along(i, k) + bound*along(i, t)
            end do
         end do
      end do
   end subroutine find_derivatives

   !> Add to the amplitudes (re, im) of these terms what the excitation gives in `tau` s, from cosine and sine of each tone at its
   !> start; `factor` (terms) are e^{λ τ}, `turn` (tones) e^{iω τ}.
   pure subroutine push(self, tau, factor, turn, tones, re, im)
      class(driven_t), intent(in) :: self
      real(wp), intent(in) :: tau, tones(:)
      complex(wp), intent(in) :: factor(:), turn(:)
      real(wp), intent(inout) :: re(:), im(:)

      complex(wp) :: change, tone
      integer :: i, t

      do t = 1, self%tones
         tone = cmplx(tones(2*t - 1), tones(2*t), wp)
         do i = 1, self%count
            change = self%p(i, t)*tone*integral(self%lambda(i), self%omega(t), tau, factor(i), turn(t)) &
                     + self%q(i, t)*conjg(tone)*integral(self%lambda(i), -self%omega(t), tau, factor(i), conjg(turn(t)))
            if (self%slope(t) > 0.0_wp) change = change + tone%im*ramped(self, i, t, tau, factor(i))
            re(i) = re(i) + real(change)
            im(i) = im(i) + aimag(change)
         end do
      end do
   end subroutine push

   !> The same by Taylor series, right to rounding if the angles of terms and tones are at most 0.08, or 3e-3 if `shorter`.
   pure subroutine push_shortly(self, tau, shorter, tones, re, im)
      class(driven_t), intent(in) :: self
      real(wp), intent(in) :: tau, tones(:)
      logical, intent(in) :: shorter
      real(wp), intent(inout) :: re(:), im(:)

      complex(wp) :: change
      integer :: i, k, t

      do t = 1, self%tones
         do i = 1, self%count
            change = (0.0_wp, 0.0_wp)
            do k = merge(formed_shorter, formed, shorter), 1, -1
               change = (change + (self%on_cosine(i, t, k)*tones(2*t - 1) + self%on_sine(i, t, k)*tones(2*t)))*(tau/k)
            end do
            re(i) = re(i) + real(change)
            im(i) = im(i) + aimag(change)
         end do
      end do
   end subroutine push_shortly

   !> The same as matrices on (cosine, sine) of all tones in turn (terms, 2 tones).
   pure subroutine tabulate_push(self, tau, factor, turn, re, im)
      class(driven_t), intent(in) :: self
      real(wp), intent(in) :: tau
      complex(wp), intent(in) :: factor(:), turn(:)
      real(wp), intent(out) :: re(:, :), im(:, :)

      complex(wp) :: plus, minus, ramp
      integer :: i, t

      do t = 1, self%tones
         do i = 1, self%count
            plus = self%p(i, t)*integral(self%lambda(i), self%omega(t), tau, factor(i), turn(t))
            minus = self%q(i, t)*integral(self%lambda(i), -self%omega(t), tau, factor(i), conjg(turn(t)))
            re(i, 2*t - 1) = real(plus + minus)
            im(i, 2*t - 1) = aimag(plus + minus)
            ramp = (0.0_wp, 0.0_wp)
            if (self%slope(t) > 0.0_wp) ramp = ramped(self, i, t, tau, factor(i))
            re(i, 2*t) = -aimag(plus - minus) + real(ramp)
            im(i, 2*t) = real(plus - minus) + aimag(ramp)
         end do
      end do
   end subroutine tabulate_push

   !> What the slope of tone t adds to term i in `tau` s for each u'/ω: ω (p + q) ∫ s e^{λ(τ - s)} ds, τ² Σ (λτ)^k/(k+2)! times
   !> ω (p + q).
   pure function ramped(self, i, t, tau, factor) result(change)
      class(driven_t), intent(in) :: self
      integer, intent(in) :: i, t
      real(wp), intent(in) :: tau
      complex(wp), intent(in) :: factor
      complex(wp) :: change

      complex(wp) :: x
      integer :: k

      x = self%lambda(i)*tau
      if (abs(x) > series_below) then
         change = (factor - 1.0_wp - x)/x**2
      else
         change = (1.0_wp, 0.0_wp)
         do k = 15, 1, -1
            change = 1.0_wp + change*x/(k + 2)
         end do
         change = 0.5_wp*change
      end if
      change = self%slope(t)*(self%p(i, t) + self%q(i, t))*tau**2*change
   end function ramped

   !> I(iω) after `tau` s, from e^{λ τ} and e^{iω τ}.
   pure function integral(lambda, omega, tau, factor, turn)
      complex(wp), intent(in) :: lambda, factor, turn
      real(wp), intent(in) :: omega, tau
      complex(wp) :: integral

      integer :: k
      ! Quotients in a chain of products would take as long as these.
      real(wp), parameter :: inverse(15) = [(1.0_wp/k, k=1, 15)]
      complex(wp) :: difference, x
      real(wp) :: size_of_x

      difference = cmplx(-real(lambda), omega - aimag(lambda), wp)
      x = difference*tau
      size_of_x = abs(real(x)) + abs(aimag(x))
      if (size_of_x > series_below) then
         integral = (turn - factor)*conjg(difference)/(real(difference)**2 + aimag(difference)**2)
         return
      end if
      integral = (1.0_wp, 0.0_wp)
      do k = merge(7, 15, size_of_x <= short_series_below), 2, -1
         integral = 1.0_wp + integral*(x*inverse(k))
      end do
      integral = tau*factor*integral
   end function integral

   !> Add to the row of a form, re and im (amplitudes, 0:4), what its derivatives feel of the excitation itself; `coefficient` and
   !> `reach` (terms) are those of these terms. `forced` (0:5) bounds what is added, `forced_reach` (0:5) its terms; `drift` (0:2)
   !> bounds by how much the terms' part in derivatives of order 4, 5 and 2 may grow per s.
   pure subroutine add_to_row(self, coefficient, reach, re, im, forced, forced_reach, drift)
      class(driven_t), intent(in) :: self
      complex(wp), intent(in) :: coefficient(:)
      real(wp), intent(in) :: reach(:)
      real(wp), intent(inout) :: re(:, 0:), im(:, 0:)
      real(wp), intent(out) :: forced(0:), forced_reach(0:), drift(0:)

      integer :: i, k, t

      forced = 0.0_wp
      forced_reach = 0.0_wp
      drift = 0.0_wp
      do k = 1, highest
         forced(k) = dot_product(abs(coefficient), self%most(:, k))
         forced_reach(k) = dot_product(reach, self%most_along(:, k))
      end do
      do i = 1, self%count
         drift = drift + abs(coefficient(i))*self%largest(i)*abs(self%lambda(i))**[4, 5, 2]
      end do
      do k = 1, ubound(re, 2)
         do t = 1, self%tones
            associate (at => self%first + self%count + t)
               do i = 1, self%count
                  re(at, k) = re(at, k) + real(coefficient(i)*self%on_cosine(i, t, k))
                  im(at, k) = im(at, k) + real(coefficient(i)*self%on_sine(i, t, k))
               end do
            end associate
         end do
      end do
   end subroutine add_to_row

end module razy_exact_closed_form_driven
