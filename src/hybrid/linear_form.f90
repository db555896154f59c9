!! Linear forms of a motion: a gap, a guard, a force and an observable are all
!!
!!     f = a·y + b·y' + c + Re(Σ_t e_t E_t),   E_t = e^{iφ_t(t)},
!!
!! with the coordinates y, their rates and the phasors E_t of the tones of excitation.
module razy_hybrid_linear_form
   use razy_core_kinds, only: wp
   implicit none(type, external)
   private

   public :: linear_form_t, new_form, zero_form

   !> a and b (m each), c, and e (tones). `of_rates`: b is not 0.
   type :: linear_form_t
      real(wp), allocatable :: on_y(:), on_v(:)
      real(wp) :: constant = 0.0_wp
      complex(wp), allocatable :: error(:)
      logical :: of_rates = .false.
   contains
      procedure :: add
      procedure :: value
      procedure :: at_rest
      procedure :: rate
      procedure :: size => size_of_terms
      procedure :: size_of_rate
   end type linear_form_t

contains

   !> The form 0 of m coordinates.
   pure function zero_form(m, tones) result(form)
      integer, intent(in) :: m, tones
      type(linear_form_t) :: form

      allocate (form%on_y(m), form%on_v(m), source=0.0_wp)
      allocate (form%error(tones), source=(0.0_wp, 0.0_wp))
   end function zero_form

   !> The form of these coefficients.
   pure function new_form(on_y, on_v, constant, error) result(form)
      real(wp), intent(in) :: on_y(:), on_v(:), constant
      complex(wp), intent(in) :: error(:)
      type(linear_form_t) :: form

      form%on_y = on_y
      form%on_v = on_v
      form%constant = constant
      form%error = error
      form%of_rates = any(abs(on_v) > 0.0_wp)
   end function new_form

   !> Add `factor` times another form.
   pure subroutine add(self, factor, other)
      class(linear_form_t), intent(inout) :: self
      real(wp), intent(in) :: factor
      type(linear_form_t), intent(in) :: other

      self%on_y = self%on_y + factor*other%on_y
      self%on_v = self%on_v + factor*other%on_v
      self%constant = self%constant + factor*other%constant
      self%error = self%error + factor*other%error
      self%of_rates = self%of_rates .or. other%of_rates
   end subroutine add

   !> f at z = (y, y') and the phasors (tones).
   pure function value(self, z, phasor) result(f)
      class(linear_form_t), intent(in) :: self
      real(wp), intent(in) :: z(:)
      complex(wp), intent(in) :: phasor(:)
      real(wp) :: f

      integer :: i, m, t

      m = size(self%on_y)
      f = self%constant
      do i = 1, m
         f = f + self%on_y(i)*z(i)
      end do
      if (self%of_rates) then
         do i = 1, m
            f = f + self%on_v(i)*z(m + i)
         end do
      end if
      do t = 1, size(phasor)
         f = f + (self%error(t)%re*phasor(t)%re - self%error(t)%im*phasor(t)%im)
      end do
   end function value

   !> f at rest in `place`, the displacements y first, without tones; a difference that is rounding is 0.
   pure function at_rest(self, place) result(f)
      class(linear_form_t), intent(in) :: self
      real(wp), intent(in) :: place(:)
      real(wp) :: f

      f = dot_product(self%on_y, place(:size(self%on_y)))
      f = merge(0.0_wp, f + self%constant, abs(f + self%constant) <= 8*epsilon(f)*abs(f))
   end function at_rest

   !> df/dt at the rates `dz` = (y', y''), without the part of the tones; of a form without b only y' is used.
   pure function rate(self, dz) result(g)
      class(linear_form_t), intent(in) :: self
      real(wp), intent(in) :: dz(:)
      real(wp) :: g

      integer :: i, m

      m = size(self%on_y)
      g = 0.0_wp
      do i = 1, m
         g = g + self%on_y(i)*dz(i)
      end do
      if (self%of_rates) then
         do i = 1, m
            g = g + self%on_v(i)*dz(m + i)
         end do
      end if
   end function rate

   !> Sum of the moduli of the terms of f at z; its rounding is some epsilon of that.
   pure function size_of_terms(self, z) result(total)
      class(linear_form_t), intent(in) :: self
      real(wp), intent(in) :: z(:)
      real(wp) :: total

      associate (m => size(self%on_y))
         total = abs(self%constant) + dot_product(abs(self%on_y), abs(z(:m))) + dot_product(abs(self%on_v), abs(z(m + 1:))) &
                 + sum(abs(self%error))
      end associate
   end function size_of_terms

   !> The same for df/dt.
   pure function size_of_rate(self, dz, omega) result(total)
      class(linear_form_t), intent(in) :: self
      real(wp), intent(in) :: dz(:), omega(:)
      real(wp) :: total

      associate (m => size(self%on_y))
         total = dot_product(abs(self%on_y), abs(dz(:m))) + sum(omega*abs(self%error))
         if (self%of_rates) total = total + dot_product(abs(self%on_v), abs(dz(m + 1:)))
      end associate
   end function size_of_rate

end module razy_hybrid_linear_form
